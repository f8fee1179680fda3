"""State of held keys: from commands and snapshots to strokes. Pure; time comes in.

Everything that is down belongs to the command that put it down. A key goes up when no command
holds it any longer. Everything goes up at once when it is disarmed, when the profile or the host
changes, and when the orb is silent. Nothing goes down but what the mapping names, and nothing
while it is disarmed.
"""

from collections import deque
from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

from controller.keymap.key_names import Chord, danger
from controller.keymap.keymap import Arm, Entry, KeyMap, Mode, Press, SelectHost, Switch, Text

SILENCE_S: Final = 1.0  # the orb reports ten times a second what is held; after this, nothing is
LETTER_S: Final = 0.012  # a typed letter is down, and then up, for so long


@dataclass(frozen=True, slots=True)
class Stroke:
    """A key that goes down or up."""

    key: str
    down: bool


@dataclass(slots=True)
class _Hold:
    """One command's hold on its keys.

    Attributes:
        press: What it presses.
        next_s: When the keys go up by themselves or, waiting, go down again.
        again_s: When they go down again, once they are up.
        down: Whether they are down.
    """

    press: Press
    next_s: float
    again_s: float = 0.0
    down: bool = False


class KeyState:
    """The keys of one player.

    Attributes:
        armed: Whether commands press anything.
        profile: The one in force.
        down: Keys that are down, in the order in which they went down.
        strokes: Strokes to make, oldest first; the owner of the device takes them.
        hosts: Numbers of the hosts that were selected, oldest first; taken as `strokes` are.
        notes: Sentences for the user, oldest first; the owner of the terminal takes them.
    """

    def __init__(self, key_map: KeyMap, *, armed: bool = False, gap_s: float = 0.0) -> None:
        """Begin with everything up, in the first profile.

        Args:
            key_map: What commands do.
            armed: Whether to begin armed.
            gap_s: How long a key that is pressed again stays up before, seconds.
        """
        self.armed = armed
        self.profile = key_map.first
        self.down: list[str] = []
        self.strokes: list[Stroke] = []
        self.hosts: list[int] = []
        self.notes: list[str] = []
        self._map = key_map
        self._gap_s = gap_s
        self._holds: dict[str, _Hold] = {}
        self._since_s: dict[str, float] = {}  # held commands whose long hold is not over
        self._reported_s = 0.0  # when the orb last reported what is held
        self._letters: deque[Chord] = deque()
        self._letter_s = 0.0  # when the next half of a letter is due

    @property
    def due_s(self) -> float | None:
        """When `tick` has something to do, None if never."""
        times = [hold.next_s for hold in self._holds.values()]
        if any(hold.press.mode is not Mode.TAP for hold in self._holds.values()):
            times.append(self._reported_s + SILENCE_S)
        if self._letters:
            times.append(self._letter_s)
        return min(times, default=None)

    def command(self, name: str, now_s: float) -> None:
        """Do what a command asks for; unknown ones, and most while disarmed, do nothing."""
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
            case Press() | Text() if self.armed and self._letters:
                self.notes.append(f"{name} was dropped: a text is being typed")
            case Press() if self.armed:
                self._reported_s = now_s
                self._press(name, entry, now_s)
            case Text() if self.armed:
                self.release()
                self._letters.extend(entry.chords)
                self._letter_s = now_s
                self.tick(now_s)

    def state(self, held: Collection[str], now_s: float) -> None:
        """Take a snapshot of the commands that are held; it releases, and never presses."""
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
        """Let time pass: taps end, held keys repeat, texts go on."""
        silent = now_s >= self._reported_s + SILENCE_S  # computed as in `due_s`
        if silent:
            self._since_s.clear()
        for name, hold in list(self._holds.items()):
            if silent and hold.press.mode is not Mode.TAP:
                self._drop(name)
                self.notes.append(f"{name} was released: the orb no longer reports what is held")
            while name in self._holds and hold.next_s <= now_s:
                self._turn(name, hold, now_s)
        self._type(now_s)

    def _end_waits(self, now_s: float) -> None:
        """Do what a long hold does; once, and only when the orb has just reported it."""
        for name, since_s in list(self._since_s.items()):
            if now_s - since_s >= self._map.long_s:
                self._since_s.pop(name, None)
                self._do(name, self._map.long[name], now_s)

    def toggle(self, why: str) -> None:
        """Disarm if armed, else arm."""
        self.disarm(why) if self.armed else self.arm(why)

    def arm(self, why: str) -> None:
        """Let commands press keys from now on."""
        if not self.armed:
            self.armed = True
            self.notes.append(f"armed {why}: profile {self.profile}")

    def disarm(self, why: str) -> None:
        """Release everything, and let commands press nothing."""
        self.release()
        if self.armed:
            self.armed = False
            self.notes.append(f"disarmed {why}")

    def switch(self, profile: str = "") -> None:
        """Release everything, and change the profile; "" is the file's next one."""
        self.release()
        names = list(self._map.profiles)
        self.profile = profile or names[(names.index(self.profile) + 1) % len(names)]
        self.notes.append(f"profile {self.profile}")

    def release(self) -> None:
        """Release everything."""
        self._holds.clear()
        self._letters.clear()
        self._since_s.clear()
        self._up(self.down)

    # -- the keys ----------------------------------------------------------------------

    def _press(self, name: str, press: Press, now_s: float) -> None:
        """Put a command's keys down, the main one again; a toggle that is down goes up."""
        before = self._holds.get(name)
        if before is not None and not before.down and press.mode is not Mode.REPEAT:
            return  # its keys are up for a moment before this press
        again = before is not None or press.chord[-1] in self.down
        self._drop(name)
        if before is not None and press.mode is Mode.TOGGLE:
            return
        hold = self._holds[name] = _Hold(press, now_s)
        if again and self._gap_s:
            self._up(press.chord[-1:])
            hold.next_s = now_s + self._gap_s
        else:
            self._turn(name, hold, now_s)

    def _turn(self, name: str, hold: _Hold, now_s: float) -> None:
        """Put a command's keys down if they are up, or else up."""
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
        """Put keys up, but for those that another command holds."""
        holds = [hold for hold in self._holds.values() if hold.down]
        self._up({*chord}.difference(*(hold.press.chord for hold in holds)))

    def _down(self, chord: Chord, name: str) -> bool:
        """Put keys down, the main one again if it is down; refuse what is dangerous together."""
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
        """Put keys up, the latest first."""
        self.strokes += [Stroke(key, down=False) for key in reversed(self.down) if key in keys]
        self.down = [key for key in self.down if key not in keys]

    def _type(self, now_s: float) -> None:
        """Put the next letter down, or up, when it is time."""
        if self._letters and self._letter_s <= now_s:
            self._letter_s = now_s + LETTER_S
            if self.down:
                self._up(self.down)
                self._letters.popleft()
            else:
                self._down(self._letters[0], "text")
