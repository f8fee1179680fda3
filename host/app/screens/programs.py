"""Control of other programs: mappings and profiles, on and off, and the key of each command."""

from functools import partial
from pathlib import Path

from controller.shared.protocol.messages import COMMANDS
from host.app import programs
from host.app.programs import Mapping, Programs
from host.app.screen import Orb, OrbScreen, rows
from host.app.screens.phone import PhoneScreen
from host.ui import naming
from tetris.kit.bindings import caption
from tetris.kit.menu import Item, Menu, Row
from tetris.kit.stage import Stage


class ProgramsScreen(OrbScreen):
    """Lists the mappings, and switches the control of other programs on and off."""

    def __init__(self, stage: Stage, orb: Orb, control: Programs, own: Path) -> None:
        self._control, self._own = control, own
        self._mappings = programs.mappings(own)
        self._chosen, self._profile = 0, 0
        super().__init__(stage, orb)

    @property
    def mapping(self) -> Mapping:
        """The chosen mapping."""
        return self._mappings[self._chosen]

    @property
    def profile(self) -> str:
        """The chosen profile."""
        return list(self.mapping.key_map.profiles)[self._profile]

    @property
    def names(self) -> list[str]:
        """The names of mapping and profile for people."""
        return [naming.mapping(self.words, one) for one in (self.mapping.path.stem, self.profile)]

    def page(self) -> Menu:
        """Return what is chosen, and whether it is on."""
        words, on, mapping = self.words, self._control.on, self.mapping
        start = partial(self._control.start, mapping, self.profile)
        hint = words("programs.start_hint")
        key, switch = ("stop", self._control.stop) if on else ("start", start)
        items = [
            self.item("programs.mapping", value=self.names[0], step=self._turn),
            self.item("programs.profile", value=self.names[1], step=self._turn_profile),
            self.item("programs.edit", self.opening(KeysScreen, self)),
            self.item(f"programs.{key}", switch, hint=hint),  # not first: no stray pinch takes it
            *([self.item("phone.title", self.opening(PhoneScreen))] if self._by_mouse else []),
            self.back_item(),
        ]
        return Menu(words("programs.title"), items, table=self._state())

    @property
    def _by_mouse(self) -> bool:
        return self.orb.virtual and not self.orb.phone

    def _state(self) -> list[Row]:
        words, control = self.words, self._control
        off = [] if control.on else rows(words("programs.off"), marked=True)  # else the dome says
        touch = rows(words("programs.mouse")) if self._by_mouse else []
        said = self._stage.told(control.said)
        why = rows(said) if said == control.said or not control.on else []  # else the state does
        return [*off, *why, *touch]

    def _turn(self, step: int) -> None:
        self._chosen = (self._chosen + step) % len(self._mappings)
        self._profile = 0

    def _turn_profile(self, step: int) -> None:
        self._profile = (self._profile + step) % len(self.mapping.key_map.profiles)

    def save(self, mapping: Mapping) -> str:
        """Keep an edited mapping, and choose it; return why not, or ""."""
        self._control.stop()
        try:
            kept = programs.save(mapping, self._own)
        except OSError:
            return self.words("programs.unsaved")
        profile = self.profile
        self._mappings = programs.mappings(self._own)
        self._chosen = [one.path for one in self._mappings].index(kept.path)
        self._profile = list(self.mapping.key_map.profiles).index(profile)
        return ""


class KeysScreen(OrbScreen):
    """The key of each command in a profile."""

    def __init__(self, stage: Stage, orb: Orb, page: ProgramsScreen) -> None:
        self._page = page
        self._before = self._mapping = page.mapping
        self._problem = ""
        super().__init__(stage, orb)

    def page(self) -> Menu:
        """Return a line for each command."""
        welcome = self._page.orb.state.welcome
        names = dict.fromkeys((*COMMANDS, *(sorted(welcome.commands) if welcome else ())))
        items = [*map(self._item, names), self.item("programs.save", self._save), self.back_item()]
        return Menu(": ".join(self._page.names), items, notice=self._problem)

    def _item(self, command: str) -> Item:
        keys = self._mapping.key(self._page.profile, command).split("+")
        value = "+".join(caption(key, self.words) for key in keys)
        name = naming.command(self.words, command)
        return Item(name, value=value, step=partial(self._turn, command))

    def _turn(self, command: str, step: int) -> None:
        profile = self._page.profile
        self._mapping = programs.choose_key(self._mapping, profile, command, step)

    def _save(self) -> None:
        changed = self._mapping is not self._before
        self._problem = self._page.save(self._mapping) if changed else ""
        if not self._problem:
            self.leave()
