"""State of held keys and buttons: from commands and snapshots to reports. Pure; time comes in.

Everything that is down belongs to the command that put it down. A tap ends after its time; what is
held ends when the orb says that it is, or says nothing for a second.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

from controller.links.bluetooth.hid.mapping import Entry, HidMap, Host, Mode, Press, Switch, danger
from controller.links.bluetooth.hid.reports import RELEASED, Report, gamepad, keyboard

WORD_S: Final = 1.0  # the loop tells at every frame what is held; after this it has stopped
UP_S: Final = 0.02  # between two taps of one key: more than a picture of a game at 60 Hz


@dataclass(slots=True)
class _Grip:
    """One command's hold on what it presses."""

    press: Press
    until_s: float  # when a tap goes up, or, waiting, comes down again
    down: bool = True


class Held:
    """The keys and buttons of one player.

    Attributes:
        profile: The one in force.
        output: Reports to send, oldest first; whoever sends them takes them.
        wishes: Other hosts that the player asked for, oldest first; taken likewise.
        told: Sentences for the log, oldest first; taken likewise.
    """

    def __init__(self, hid_map: HidMap) -> None:
        """Begin with everything up, in the first profile."""
        self.profile = next(iter(hid_map.profiles))
        self.output: list[Report] = []
        self.wishes: list[Host] = []
        self.told: list[str] = []
        self._map = hid_map
        self._grips: dict[str, _Grip] = {}
        self._heard_s = 0.0  # when the loop last told what is held
        self._latest = {report.id: report for report in RELEASED}

    @property
    def latest(self) -> dict[int, Report]:
        """The newest report of each id, for a host that asks."""
        return self._latest

    @property
    def due_s(self) -> float | None:
        """When `tick` has something to do, None if never."""
        times = [
            self._heard_s + WORD_S if grip.press.mode is Mode.HOLD else grip.until_s
            for grip in self._grips.values()
        ]
        return min(times, default=None)

    def command(self, name: str, now_s: float) -> None:
        """Do what a command asks for; one that the mapping does not name does nothing."""
        self.tick(now_s)
        entry: Entry | None = self._map.profiles[self.profile].get(name)
        match entry:
            case Switch(profile=profile):
                self.release()
                self.profile = profile
                self.told.append(f"profile {profile}")
            case Host():
                self.release()
                self.wishes.append(entry)
            case Press():
                self._heard_s = now_s
                self._press(name, entry, now_s)

    def state(self, held: Collection[str], now_s: float) -> None:
        """Take a snapshot of the commands that are held; it lets go, and never presses."""
        self._heard_s = now_s
        for name, grip in list(self._grips.items()):
            if grip.press.mode is Mode.HOLD and name not in held:
                del self._grips[name]
        self.tick(now_s)

    def word(self, now_s: float) -> None:
        """Take note that what was held still is."""
        self._heard_s = now_s
        self.tick(now_s)

    def tick(self, now_s: float) -> None:
        """Let time pass."""
        for name, grip in list(self._grips.items()):
            if grip.press.mode is Mode.HOLD:
                if now_s >= self._heard_s + WORD_S:  # as `due_s` says it
                    del self._grips[name]
                    self.told.append(f"{name} was let go: the orb no longer says what is held")
            elif grip.until_s <= now_s and grip.down:
                del self._grips[name]
            elif grip.until_s <= now_s:
                grip.down, grip.until_s = True, now_s + grip.press.down_s
        self._tell()

    def release(self) -> None:
        """Let go of everything, and say so in every report, whatever was said before."""
        self._grips.clear()
        self._latest = {report.id: report for report in RELEASED}
        self.output += RELEASED

    def _press(self, name: str, press: Press, now_s: float) -> None:
        grip = self._grips.get(name)
        if grip is not None and grip.press.mode is Mode.TAP:
            if grip.down:  # a second tap is a second one only if there is some time in between
                grip.down, grip.until_s = False, now_s + UP_S
        else:
            down = [*self._down("keys"), *press.keys]
            if risk := danger(down, self._map.allowed):
                self.told.append(f"{name} was not pressed: {risk} would be down")
                return
            self._grips[name] = _Grip(press, now_s + press.down_s)
        self._tell()

    def _down(self, part: str) -> list[str]:
        """Return what is down on the keyboard ("keys") or on the pad ("pad"), in order."""
        grips = [grip for grip in self._grips.values() if grip.down]
        return [name for grip in grips for name in getattr(grip.press, part)]

    def _tell(self) -> None:
        """Report what has changed."""
        for report in (keyboard(self._down("keys")), gamepad(self._down("pad"))):
            if report != self._latest[report.id]:
                self._latest[report.id] = report
                self.output.append(report)
