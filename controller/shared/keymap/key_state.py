"""State of held keys: from commands and snapshots to strokes; pure, with explicit time.

Each held key belongs to the commands that pressed it, and is released when the last one ends. All
keys are released on disarming, on a change of profile or host, and when the orb is silent. Only
keys of the mapping are pressed, and none while disarmed.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

from controller.shared.keymap.key_names import Chord, danger
from controller.shared.keymap.keymap import (
    Arm,
    Entry,
    KeyMap,
    Mode,
    Press,
    SelectHost,
    Switch,
)

SILENCE_S: Final = 1.0  # timeout of the orb's reports, which come ten times a second


@dataclass(frozen=True, slots=True)
class Stroke:
    """A press or release of a key."""

    key: str
    down: bool


@dataclass(slots=True)
class _Hold:
    """One command's hold on its keys."""

    press: Press
    next_s: float  # time of the next release or, if they are up, press
    again_s: float = 0.0  # time of the next press, once they are up
    down: bool = False


class KeyState:
    """The keys of one player.

    Attributes:
        armed: Whether commands press keys.
        profile: The active profile.
        down: Held keys, in the order of their presses.
        strokes: Strokes to execute, oldest first; the caller removes them.
        hosts: Numbers of selected hosts, oldest first; the caller removes them.
        notes: Sentences for the user, oldest first; the caller removes them.
    """

    def __init__(
        self,
        key_map: KeyMap,
        *,
        armed: bool = False,
        gap_s: float = 0.0,
        silence_s: float = SILENCE_S,
    ) -> None:
        """Begin in the first profile.

        Args:
            key_map: The mapping.
            armed: Whether commands press keys.
            gap_s: Pause until a held key is pressed again, seconds.
            silence_s: Held keys are released so many seconds after the orb's last report.
        """
        self.armed = armed
        self.profile = key_map.first
        self.down: list[str] = []
        self.strokes: list[Stroke] = []
        self.hosts: list[int] = []
        self.notes: list[str] = []
        self._map = key_map
        self._gap_s, self._silence_s = gap_s, silence_s
        self._holds: dict[str, _Hold] = {}
        self._since_s: dict[str, float] = {}  # start of held commands before their long hold
        self._reported_s = 0.0  # time of the orb's last report

    @property
    def due_s(self) -> float | None:
        """Time of the next change by `tick`, None if there is none."""
        times = [hold.next_s for hold in self._holds.values()]
        if any(hold.press.mode is not Mode.TAP for hold in self._holds.values()):
            times.append(self._reported_s + self._silence_s)
        return min(times, default=None)

    def command(self, name: str, now_s: float) -> None:
        """Execute a command; unknown ones, and most while disarmed, have no effect."""
        self.tick(now_s)
        self._do(name, self._map.profiles[self.profile].get(name), now_s)
        if name in self._map.long:
            self._reported_s = self._since_s[name] = now_s

    def _do(self, name: str, entry: Entry | None, now_s: float) -> None:
        match entry:
            case Arm():
                self.toggle("by the orb")
            case Switch(profile=profile):
                self.switch(profile)
            case SelectHost(number=number):
                self.release()
                self.hosts.append(number)
            case Press() if self.armed:
                self._reported_s = now_s
                self._press(name, entry, now_s)

    def state(self, held: Collection[str], now_s: float) -> None:
        """Update by a snapshot of the held commands, which only releases keys."""
        self._reported_s = now_s
        self.tick(now_s)
        self._since_s = {name: s for name, s in self._since_s.items() if name in held}
        self._end_waits(now_s)
        for name, hold in list(self._holds.items()):
            if hold.press.mode in (Mode.HOLD, Mode.REPEAT) and name not in held:
                self._drop(name)

    def still_held(self, now_s: float) -> None:
        """Record that the orb still holds what it held."""
        self._reported_s = now_s
        self.tick(now_s)
        self._end_waits(now_s)

    def tick(self, now_s: float) -> None:
        """Advance to the present time: end taps, repeat held keys."""
        silent = now_s >= self._reported_s + self._silence_s  # computed as in `due_s`
        if silent:
            self._since_s.clear()
        for name, hold in list(self._holds.items()):
            if silent and hold.press.mode is not Mode.TAP:
                self._drop(name)
                self.notes.append(f"{name} was released: the orb no longer reports what is held")
            while name in self._holds and hold.next_s <= now_s:
                self._toggle(name, hold, now_s)

    def _end_waits(self, now_s: float) -> None:
        """Execute long holds, once, and only after a report of the orb."""
        for name, since_s in list(self._since_s.items()):
            if now_s - since_s >= self._map.long_s:
                self._since_s.pop(name, None)
                self._do(name, self._map.long[name], now_s)

    def toggle(self, why: str) -> None:
        """Disarm if armed, else arm."""
        self.disarm(why) if self.armed else self.arm(why)

    def arm(self, why: str) -> None:
        """Enable key presses."""
        if not self.armed:
            self.armed = True
            self.notes.append(f"armed {why}: profile {self.profile}")

    def disarm(self, why: str) -> None:
        """Release all keys, and disable key presses."""
        self.release()
        if self.armed:
            self.armed = False
            self.notes.append(f"disarmed {why}")

    def switch(self, profile: str = "") -> None:
        """Release all keys, and change the profile; "" is the next one of the file."""
        self.release()
        names = list(self._map.profiles)
        self.profile = profile or names[(names.index(self.profile) + 1) % len(names)]
        self.notes.append(f"profile {self.profile}")

    def release(self) -> None:
        """Release all keys."""
        self._holds.clear()
        self._since_s.clear()
        self._up(self.down)

    # -- the keys ----------------------------------------------------------------------

    def _press(self, name: str, press: Press, now_s: float) -> None:
        """Press a command's keys, the main one again; a toggle that is down is released."""
        before = self._holds.get(name)
        if before is not None and not before.down and press.mode is not Mode.REPEAT:
            return  # its keys are in the pause before a press
        again = before is not None or press.chord[-1] in self.down
        self._drop(name)
        if before is not None and press.mode is Mode.TOGGLE:
            return
        hold = self._holds[name] = _Hold(press, now_s)
        if again and self._gap_s:
            self._up(press.chord[-1:])
            hold.next_s = now_s + self._gap_s
        else:
            self._toggle(name, hold, now_s)

    def _toggle(self, name: str, hold: _Hold, now_s: float) -> None:
        """Press a command's keys if they are up, else release them."""
        if not hold.down:
            self._begin(name, hold, now_s)
        elif hold.press.mode is Mode.REPEAT:
            hold.down, hold.next_s = False, hold.again_s
            self._lift(hold.press.chord)
        else:
            self._drop(name)

    def _begin(self, name: str, hold: _Hold, now_s: float) -> None:
        press = hold.press
        if not self._down(press.chord, name):
            del self._holds[name]
            return
        ends = press.mode in (Mode.TAP, Mode.REPEAT)
        hold.down, hold.again_s = True, now_s + press.every_s
        hold.next_s = now_s + press.down_s if ends else float("inf")

    def _drop(self, name: str) -> None:
        """End a command's hold on its keys."""
        if (hold := self._holds.pop(name, None)) is not None and hold.down:
            self._lift(hold.press.chord)

    def _lift(self, chord: Chord) -> None:
        """Release keys, except those held by another command."""
        holds = [hold for hold in self._holds.values() if hold.down]
        self._up({*chord}.difference(*(hold.press.chord for hold in holds)))

    def _down(self, chord: Chord, name: str) -> bool:
        """Press keys, the main one again if it is down; refuse dangerous combinations."""
        if risk := danger({*self.down, *chord}, self._map.allowed):
            self.notes.append(f"{name} was dropped: with what is down it would make {risk}")
            return False
        self._up([key for key in chord[-1:] if key in self.down])
        for key in chord:
            if key not in self.down:
                self.down.append(key)
                self.strokes.append(Stroke(key, down=True))
        return True

    def _up(self, keys: Collection[str]) -> None:
        """Release keys, the latest first."""
        self.strokes += [Stroke(key, down=False) for key in reversed(self.down) if key in keys]
        self.down = [key for key in self.down if key not in keys]
