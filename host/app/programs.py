"""Control of other programs from the application: commands press a mapping's keys in them.

Only while the window is in the background; in the foreground they steer the window itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import tomli_w

from controller.shared.config import ConfigError
from controller.shared.files import atomic_write, config_folder
from controller.shared.keymap import keymap
from controller.shared.keymap.key_names import KEYS, PAD
from controller.shared.keymap.keymap import KeyMap, KeyMapError, Kind
from controller.shared.protocol.link_events import Delivered, Received
from controller.shared.protocol.messages import Command, State
from host.injection.backends import BackendError
from host.injection.injector import Injector, Sender
from host.targets.keys import ARM_KEY, OUTPUTS, PROFILE_KEY, KeysTarget

SHIPPED: Final[tuple[Kind, ...]] = ("keyboard", "gamepad")
_NAMED: Final = {"keyboard": "key", "gamepad": "pad"}  # how a mapping's file calls an output


def folder() -> Path:
    """Return where the user's own mappings are; it may not exist yet."""
    return config_folder() / "mappings"


def keys(kind: Kind) -> list[str]:
    """Return the names that a mapping of a kind may press, as its file writes them."""
    return [*KEYS] if kind == "keyboard" else [name.removeprefix("pad_") for name in PAD]


@dataclass(frozen=True, slots=True)
class Mapping:
    """A mapping, shipped or of the user's folder, that can be used.

    `table` is its file; `key_map` the same parsed.
    """

    path: Path
    kind: Kind
    table: dict[str, Any]
    key_map: KeyMap

    @property
    def shipped(self) -> bool:
        """Whether it came with the program."""
        return str(self.path) in SHIPPED

    def key(self, profile: str, command: str) -> str:
        """Return the key of a command, as its file writes it; "" where it presses none."""
        entry = self.table["profile"][profile].get(command, "")
        if isinstance(entry, str):
            return entry if self.kind == "keyboard" else ""
        return str(entry.get(_NAMED[self.kind], ""))

    def changed(self, profile: str, command: str, key: str) -> "Mapping":
        """Return it with another key of a command; ConfigError if that cannot be."""
        entries = dict(self.table["profile"][profile])
        before = entries.get(command)
        timed = before if isinstance(before, dict) else {}
        timing = {name: value for name, value in timed.items() if name in _TIMING}
        entries[command] = {_NAMED[self.kind]: key, **timing}
        table = {**self.table, "profile": {**self.table["profile"], profile: entries}}
        return Mapping(self.path, self.kind, table, keymap.parse(table, OUTPUTS[self.kind]))


_TIMING: Final = ("mode", "down_ms", "every_ms")


def mappings(own: Path) -> list[Mapping]:
    """Return the shipped mappings and those of a folder; files that are none are left out."""
    paths = [*map(Path, SHIPPED), *(sorted(own.glob("*.toml")) if own.is_dir() else ())]
    return [found for path in paths if (found := read(path))]


def read(path: Path) -> Mapping | None:
    """Return a mapping of either kind; None if it is none."""
    for kind in [kind for kind in SHIPPED if str(path) == kind] or SHIPPED:
        try:
            return Mapping(path, kind, *keymap.read(path, OUTPUTS[kind]))
        except KeyMapError:
            pass
    return None


def save(mapping: Mapping, own: Path) -> Mapping:
    """Write a mapping to the user's folder, a shipped one under a new name; return it there.

    OSError if it cannot be written.
    """
    path = mapping.path
    if mapping.shipped:
        number = 1
        while (path := own / f"{mapping.path.name}-{number}.toml").exists():
            number += 1
    own.mkdir(parents=True, exist_ok=True)
    atomic_write(path, tomli_w.dumps(mapping.table).encode())
    return Mapping(path, mapping.kind, mapping.table, mapping.key_map)


class Programs:
    """The keys target beside the game.

    Attributes:
        said: The newest sentence about arming, or why it does not start.
        mapping, profile: In use, or chosen last.
    """

    def __init__(self, make_sender: type[Injector] = Injector) -> None:
        self.said, self.profile = "", ""
        self.mapping: Mapping | None = None
        self._make_sender = make_sender
        self._target: KeysTarget | None = None
        self._behind = False

    @property
    def on(self) -> bool:
        """Whether it is switched on; it may be disarmed."""
        return self._target is not None

    @property
    def armed(self) -> bool:
        """Whether commands press keys."""
        return self._target is not None and self._target.keys.armed

    def start(self, mapping: Mapping, profile: str) -> None:
        """Switch it on, armed: that is the user's decision; `said` is why not if no key can be."""
        self.stop()
        self.mapping, self.profile, self.said = mapping, profile, ""
        key_map = mapping.key_map.beginning(profile)
        sender: Sender = self._make_sender("auto", mapping.kind, key_map.keys)
        try:
            sender.start()
        except BackendError as error:
            self.said = str(error)
            return
        say = partial(setattr, self, "said")
        self._target = KeysTarget(key_map, sender, say, lambda armed: None)
        self._target.keys.armed = True

    def stop(self) -> None:
        """Release all keys, and switch it off."""
        target, self._target = self._target, None
        if target is not None:
            target.close()
            self.said = ""

    def hot_key(self, name: str) -> bool:
        """Take a key of the window; return whether it arms, or changes the profile."""
        if self._target is None or name not in (ARM_KEY, PROFILE_KEY):
            return False
        self._target.hot_key(name)
        return True

    def tick(self, now_s: float, received: Sequence[Received], *, behind: bool) -> None:
        """Press keys for what came; commands count only while the window is `behind` others."""
        if self._target is None:
            return
        if self._behind and not behind:
            self._target.keys.release()
        self._behind = behind
        self._target.tick(now_s, [item for item in received if behind or not _acts(item)])
        self.profile = self._target.profile


def _acts(item: Received) -> bool:
    return isinstance(item, Delivered) and isinstance(item.message, Command | State)


def choose_key(mapping: Mapping, profile: str, command: str, step: int) -> Mapping:
    """Return a mapping with the next key, or the one before, that a command can have."""
    names = keys(mapping.kind)
    present = mapping.key(profile, command)
    place = names.index(present) if present in names else -1 if step > 0 else 0
    for _ in names:
        place += step
        try:
            return mapping.changed(profile, command, names[place % len(names)])
        except ConfigError:  # a dangerous one
            continue
    return mapping
