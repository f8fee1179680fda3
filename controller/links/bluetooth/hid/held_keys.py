"""Keys held by the messages of the control loop, as reports for HID over Bluetooth and USB."""

from itertools import groupby
from pathlib import Path
from typing import Final
from urllib.parse import parse_qsl

from controller.links.base import LinkError
from controller.links.bluetooth.hid.reports import (
    NO_CONTACT,
    OUTPUTS,
    RELEASED,
    Report,
    axes,
    gamepad,
    keyboard,
)
from controller.shared.keymap import keymap
from controller.shared.keymap.key_state import KeyState
from controller.shared.keymap.keymap import KeyMap
from controller.shared.protocol.messages import (
    Command,
    ContactState,
    Message,
    State,
    Telemetry,
    Welcome,
    hold_ms,
)

Taken = Command | ContactState | State | Telemetry  # messages that change keys or axes

GAP_S: Final = 0.02  # between two taps of one key: more than a frame of a game at 60 Hz


class HeldKeys(KeyState):
    """Keys and axes of a HID device, which are armed from the beginning."""

    def __init__(
        self, key_map: KeyMap, rate_hz: float = 40.0, grid: tuple[int, int] = (5, 5)
    ) -> None:
        """Begin with released keys; a loop that sends no frames, `rate_hz`, holds nothing.

        `grid` is the sensor's, (rows, columns).
        """
        super().__init__(key_map, armed=True, gap_s=GAP_S, silence_s=hold_ms(rate_hz) / 1000)
        self._reported: list[str] = []  # what is down in the latest reports
        self._latest = RELEASED
        self._grid = grid
        self._axes, self._touched_s = NO_CONTACT, 0.0  # of the contact, and when it came

    @property
    def due_s(self) -> float | None:
        """Time of the next change by `tick`, None if there is none."""
        times = [super().due_s]
        if self._axes != NO_CONTACT:
            times.append(self._touched_s + self._silence_s)
        return min((time_s for time_s in times if time_s is not None), default=None)

    def tick(self, now_s: float) -> None:
        """Advance to the present time; axes rest if no newer contact has come."""
        super().tick(now_s)
        if now_s >= self._touched_s + self._silence_s:
            self._axes = NO_CONTACT

    def take(self, message: Message, now_s: float) -> None:
        """Change keys or axes by a message, if it is one of `Taken`."""
        match message:
            case ContactState():
                self.tick(now_s)
                self._axes, self._touched_s = axes(message, self._grid), now_s
            case Command(name=name):
                self.command(name, now_s)
            case State(pressed=pressed):
                self.state(pressed, now_s)
            case Telemetry(gesture=""):
                self.state((), now_s)
            case Telemetry():
                self.still_held(now_s)

    def reports(self) -> list[Report]:
        """Return the reports of new strokes: keys that go down, or up, together share a report."""
        reports, strokes, self.strokes = [], self.strokes, []
        for down, group in groupby(strokes, lambda stroke: stroke.down):
            keys = [stroke.key for stroke in group]
            self._reported = [key for key in self._reported if key not in keys]
            self._reported += keys if down else []
            reports += self._changed()
        return reports or self._changed()

    def _changed(self) -> list[Report]:
        """Return the reports that differ from the latest."""
        pad = {key.removeprefix("pad_") for key in self._reported if key.startswith("pad_")}
        typed = [key for key in self._reported if not key.startswith("pad_")]
        before, self._latest = self._latest, (keyboard(typed), gamepad(pad, self._axes))
        return [report for report in self._latest if report not in before]

    def reset(self) -> tuple[Report, ...]:
        """Release all keys; return the reports of that, also if nothing was held."""
        self.release()
        self.strokes, self._reported, self._latest = [], [], RELEASED
        self._axes = NO_CONTACT
        return RELEASED


def parse(url: str, form: str, welcome: Welcome) -> tuple[str, HeldKeys]:
    """Return the device that a URL names, "" for the first one, and the keys of its mapping.

    LinkError if the URL has not the `form`, as text; KeyMapError if the mapping cannot be used.
    """
    device, _, query = url.partition(":")[2].partition("?")
    options = dict(parse_qsl(query, keep_blank_values=True))
    if "/" in device or set(options) - {"keys"}:
        raise LinkError(f"cannot understand {url}; write {form}, ?keys=FILE (orbtouch docs hid)")
    key_map = keymap.load(Path(options.get("keys", "gamepad")), OUTPUTS)
    return device, HeldKeys(key_map, welcome.rate_hz, (welcome.rows, welcome.columns))
