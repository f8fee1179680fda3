"""State of held keys: from commands and snapshots to strokes. Pure; time comes in.

Everything that is down belongs to the command that put it down. A key goes up when no command
holds it any longer, and everything goes up at once when it is disarmed, when the profile changes,
and when the orb is silent. Nothing goes down but what the mapping names, and nothing while it is
disarmed.
"""

from collections import deque
from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

from controller.keymap.key_names import Chord, danger
from controller.keymap.keymap import Arm, Entry, KeyMap, Mode, Press, Switch, Text

WORD_S: Final = 1.0  # the orb tells ten times a second what is held; after this it holds nothing
LETTER_S: Final = 0.012  # a typed letter is down, and then up, for so long


@dataclass(frozen=True, slots=True)
class Stroke:
    """A key that goes down or up."""

    key: str
    down: bool


@dataclass(slots=True)
class _Grip:
    """One command's hold on its keys."""

    press: Press
    up_s: float  # when they go up by themselves
    again_s: float  # when they go down again
    down: bool = True


class KeyState:
    """The keys of one player.

    Attributes:
        armed: Whether commands press anything.
        profile: The one in force.
        down: What is down, in the order in which it went down.
        output: Strokes to make, oldest first; the owner of the device takes them.
        told: Sentences for the user, oldest first; the owner of the terminal takes them.
    """

    def __init__(self, key_map: KeyMap) -> None:
        """Begin disarmed, in the first profile."""
        self.armed = False
        self.profile = key_map.first
        self.down: list[str] = []
        self.output: list[Stroke] = []
        self.told: list[str] = []
        self._map = key_map
        self._grips: dict[str, _Grip] = {}
        self._since_s: dict[str, float] = {}  # held commands for which something waits
        self._heard_s = 0.0  # when the orb last told what is held
        self._letters: deque[Chord] = deque()
        self._letter_s = 0.0  # when the next half of a letter is due

    @property
    def entries(self) -> dict[str, Entry]:
        """What commands do in this profile."""
        return self._map.profiles[self.profile]

    def command(self, name: str, now_s: float) -> None:
        """Do what a command asks for; unknown ones, and most while disarmed, do nothing."""
        self.tick(now_s)
        self._do(name, now_s)
        if name in self._map.long:
            self._heard_s = self._since_s[name] = now_s

    def _do(self, name: str, now_s: float) -> None:
        entry = self.entries.get(name)
        match entry:
            case Arm():
                self._toggle()
            case Switch(profile=profile):
                self.switch(profile)
            case Press() if self.armed and not self._letters:
                self._heard_s = now_s
                self._press(name, entry, now_s)
            case Text() if self.armed and not self._letters:
                self.release()
                self._letters.extend(entry.chords)
                self._letter_s = now_s
                self.tick(now_s)
            case Press() | Text() if self.armed:
                self.told.append(f"{name} was dropped: a text is being typed")

    def state(self, held: Collection[str], now_s: float) -> None:
        """Take a snapshot of the commands that are held; it lets go, and never presses."""
        self._heard_s = now_s
        self.tick(now_s)
        for name in [name for name in self._since_s if name not in held]:
            del self._since_s[name]
        self._wait(now_s)
        for name, grip in list(self._grips.items()):
            if grip.press.mode in (Mode.HOLD, Mode.REPEAT) and name not in held:
                self._drop(name)

    def word(self, now_s: float) -> None:
        """Take note that the orb still holds what it held."""
        self._heard_s = now_s
        self.tick(now_s)
        self._wait(now_s)

    def tick(self, now_s: float) -> None:
        """Let time pass: taps end, held keys repeat, texts go on."""
        if now_s - self._heard_s >= WORD_S:
            self._since_s.clear()
        for name, grip in list(self._grips.items()):
            lasting = grip.press.mode in (Mode.HOLD, Mode.REPEAT)
            if lasting and now_s - self._heard_s >= WORD_S:
                self._drop(name)
                self.told.append(f"{name} was let go: the orb no longer says that it is held")
            elif grip.press.mode is Mode.REPEAT:
                self._repeat(name, grip, now_s)
            elif grip.up_s <= now_s:
                self._drop(name)
        self._type(now_s)

    def _wait(self, now_s: float) -> None:
        """Do what a long hold does; once, and only when the orb has just said that it lasts."""
        for name, since_s in list(self._since_s.items()):
            if now_s - since_s >= self._map.long_s:
                del self._since_s[name]
                entry = self._map.long[name]
                if isinstance(entry, Switch):
                    self.switch(entry.profile)
                else:
                    self._toggle()

    def _toggle(self) -> None:
        self.disarm("by the orb") if self.armed else self.arm("by the orb")

    def arm(self, why: str) -> None:
        """Let commands press keys from now on."""
        if not self.armed:
            self.armed = True
            self.told.append(f"armed {why}: profile {self.profile}")

    def disarm(self, why: str) -> None:
        """Let go of everything, and let commands press nothing."""
        self.release()
        if self.armed:
            self.armed = False
            self.told.append(f"disarmed {why}")

    def switch(self, profile: str) -> None:
        """Let go of everything, and change the profile."""
        self.release()
        self.profile = profile
        self.told.append(f"profile {profile}")

    def switch_on(self) -> None:
        """Change to the next profile of the file."""
        names = list(self._map.profiles)
        self.switch(names[(names.index(self.profile) + 1) % len(names)])

    def release(self) -> None:
        """Let go of everything."""
        self._grips.clear()
        self._letters.clear()
        self._since_s.clear()
        self._up(self.down)

    # -- the keys ----------------------------------------------------------------------

    def _press(self, name: str, press: Press, now_s: float) -> None:
        """Put a command's keys down; a toggle that is down goes up."""
        was_down = name in self._grips
        self._drop(name)
        if was_down and press.mode is Mode.TOGGLE:
            return
        if not self._down(press.chord, name):
            return
        up_s = now_s + press.down_s if press.mode in (Mode.TAP, Mode.REPEAT) else float("inf")
        self._grips[name] = _Grip(press, up_s, now_s + press.every_s)

    def _repeat(self, name: str, grip: _Grip, now_s: float) -> None:
        if grip.down and grip.up_s <= now_s:
            grip.down = False
            self._let_go(grip)
        if grip.again_s <= now_s:  # once, however late it is
            if self._down(grip.press.chord, name):
                grip.down = True
                grip.up_s, grip.again_s = now_s + grip.press.down_s, now_s + grip.press.every_s
            else:
                self._drop(name)

    def _drop(self, name: str) -> None:
        grip = self._grips.pop(name, None)
        if grip is not None:
            self._let_go(grip)

    def _let_go(self, grip: _Grip) -> None:
        """Lift a grip's keys, but for those that another one holds."""
        others = {key for g in self._grips.values() if g.down for key in g.press.chord}
        self._up([key for key in grip.press.chord if key not in others])

    def _down(self, chord: Chord, name: str) -> bool:
        """Put keys down, the main one anew if it is down; refuse what is dangerous together."""
        if risk := danger({*self.down, *chord}, self._map.allowed):
            self.told.append(f"{name} was dropped: with what is down it would make {risk}")
            return False
        self._up([key for key in chord[-1:] if key in self.down])
        for key in chord:
            if key not in self.down:
                self.down.append(key)
                self.output.append(Stroke(key, down=True))
        return True

    def _up(self, keys: Collection[str]) -> None:
        """Lift keys, the latest first."""
        for key in reversed(self.down):
            if key in keys:
                self.output.append(Stroke(key, down=False))
        self.down = [key for key in self.down if key not in keys]

    def _type(self, now_s: float) -> None:
        """Put the next letter down, or lift it, when it is time."""
        if self._letters and self._letter_s <= now_s:
            self._letter_s = now_s + LETTER_S
            if self.down:
                self._up(self.down)
                self._letters.popleft()
            else:
                self._down(self._letters[0], "text")
