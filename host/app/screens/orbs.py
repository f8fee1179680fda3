"""The orbs: which there are, the one that is connected, and what can be done with it."""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

from controller.shared.files import data_folder
from controller.shared.notices import Notice
from controller.shared.protocol.messages import Command, Contact, Report
from controller.shared.protocol.teaching import (
    FAILED,
    Check,
    CheckRow,
    CheckStep,
    LearnStatus,
    Recalibrate,
    Vocabulary,
)
from host.app.orbs import Orbs
from host.app.programs import Programs, folder
from host.app.screen import Orb, OrbScreen, rows
from host.app.screens.phone import PhoneScreen
from host.app.screens.programs import ProgramsScreen
from host.app.screens.teach.strength import named
from host.connection.device_store import KnownDevice
from host.connection.discovery import NOW
from host.ui.naming import check_name, said
from tetris.kit.menu import Item, Menu, Row
from tetris.kit.stage import Stage

_HASH: Final = re.compile(r"[0-9a-f]{16}")  # name of an installed bundle
_VERDICTS: Final = ("FAULT", "doubtful", "not checked", "good")  # worst first
_AFTER_S: Final = 2.0  # the last press of the check does not steer the menu
_PLACES: Final = ("taxel", "taxel_at")  # notices with row and column
_GHOST_MM: Final = (8.0, 7.0)  # depth and radius of the finger that shows where to press


class OrbsScreen(OrbScreen):
    """Lists orbs, and leads to the pages about the present one."""

    def __init__(
        self,
        stage: Stage,
        orb: Orb,
        orbs: Orbs,
        programs: Programs,
        show_lab: Callable[[], None],
    ) -> None:
        """Show the list, and begin a scan."""
        self.orbs, self._programs, self._show_lab = orbs, programs, show_lab
        super().__init__(stage, orb)
        orbs.scan()

    def page(self) -> Menu:
        """Return the list, and what can be done with the present orb and with others."""
        orbs, words = self.orbs, self.words
        search = "orbs.searching" if orbs.scanning else "orbs.search"
        items = [self._choice(entry) for entry in orbs.entries()]
        items.append(self.item(search, orbs.scan, hint=words("orbs.search_hint")))
        items += [
            self.item("orb.title", self.opening(PresentOrbScreen)),
            self.item("phone.title", self.opening(PhoneScreen)),
            self.item("programs.title", self.opening(ProgramsScreen, self._programs, folder())),
            self.item("lab.title", self._show_lab),
            self.back_item(),
        ]
        table = [] if self.orb.state.link == "live" else self.link_rows()[:2]
        return Menu(words("orbs.title"), items, table, self._stage.told(orbs.notice))

    def _choice(self, entry: KnownDevice) -> Item:
        words = self.words
        name = (entry.name or entry.device_id) if entry.device_id else words("orbs.virtual")
        state = self.orb.state
        linked = state.welcome if state.link in ("live", "stale") else None
        if self.orbs.present(entry, linked.device_id if linked else ""):
            value = words(f"orbs.link_{state.link}")
        else:
            value = words("orbs.here") if entry.seen == NOW else entry.seen[:10]
        hint = words("orbs.known_hint" if entry.device_id else "orbs.own_hint")
        return Item(name, partial(self.orbs.choose, entry), value, hint=hint)


class PresentOrbScreen(OrbScreen):
    """The connected orb: its state, its health, its rest image, its skin, its gestures."""

    _detailed = False

    def page(self) -> Menu:
        """Return its state, and what can be done; the check comes first where it is needed."""
        rest = self.item("orb.rest", partial(self.orb.send, Recalibrate()))
        check = self.item("check.title", self.opening(CheckScreen))
        install = self.item("install.title", self.opening(InstallScreen))
        first = (check, rest) if self.orb.state.health else (rest, check)
        items = [
            *((*first, install) if self.orb.state.link == "live" else ()),
            self.item("orb.details", self._turn_details),
            self.back_item(),
        ]
        table = self._details() if self._detailed else self._state()
        return Menu(self.words("orb.title"), items, table=table)

    def _turn_details(self) -> None:
        self._detailed = not self._detailed

    def _details(self) -> list[Row]:
        """Return names, numbers and folders, as terminals print them."""
        welcome, bundle = self.orb.state.welcome, self.orb.lessons.vocabulary
        told = [welcome.device_id] if welcome else []
        told += [one for one in (bundle.bundle, bundle.folder) if one] if bundle else []
        told += [*self.orb.state.health, *self.orb.originals]
        return [row for line in told for row in rows(line)]

    def _state(self) -> list[Row]:
        """Return how it is, in lines."""
        words, state = self.words, self.orb.state
        if state.link != "live" or state.welcome is None:
            return self.link_rows()
        lines = [Row((words("orb.state"), f"{state.welcome.name}, {state.rate_hz:.0f} Hz"))]
        if not state.ready:
            lines += rows(words("orb.resting"), marked=True)
        if (bundle := self.orb.lessons.vocabulary) is not None:
            lines.append(Row((words("orb.bundle"), self._gestures(bundle))))
        if state.sure:
            lines.append(Row((words("orb.user"), state.user or words("orb.unknown"))))
        if (strength := self.orb.lessons.strength(state.user)) != 1.0:
            lines.append(Row((words("strength.title"), named(words, strength))))
        found = [row for one in state.health for row in rows(said(words, one))]
        return lines + (found or [Row((words("orb.health"), words("orb.healthy")))])

    def _gestures(self, bundle: Vocabulary) -> str:
        """Return a bundle's name for people, with the number of taught gestures."""
        words, name = self.words, bundle.bundle
        if _HASH.fullmatch(name):
            name = words("orb.installed")
        name = name or words("orb.shipped")
        if not bundle.taught:
            return name
        key = "orb.taught_one" if bundle.taught == 1 else "orb.taught_more"
        return f"{name}, {words(key, count=bundle.taught)}"


class InstallScreen(OrbScreen):
    """Lists the bundles of the data folder, and sends the orb one."""

    def __init__(self, stage: Stage, orb: Orb) -> None:
        """Show the bundles that there are now."""
        self._problem, self._files = "", bundles(data_folder())
        super().__init__(stage, orb)

    def page(self) -> Menu:
        """Return the files, and how the upload goes."""
        words, (said, share) = self.words, self.installation()
        items = [
            Item(path.stem, partial(self._install, path), hint=words("install.send_hint"))
            for path in self._files
        ]
        table = rows(said) if share is None else [Row((said, words.number(share, ".0%")))]
        if not self._files:
            table = rows(words("install.none"))
        items.append(self.back_item())
        return Menu(words("install.title"), items, table=table, notice=self._problem)

    def _install(self, path: Path) -> None:
        self._problem = self._stage.told(self.orb.install(path))


def bundles(where: Path) -> list[Path]:
    """Return the bundles in a folder and in its folder "bundles", by name."""
    return sorted([*where.glob("*.orb"), *where.glob("bundles/*.orb")])


class CheckScreen(OrbScreen):
    """Leads through a calibration and the checks, which run in the orb."""

    def __init__(self, stage: Stage, orb: Orb) -> None:
        self.orb = orb
        self._begin()
        super().__init__(stage, orb)

    def _begin(self) -> None:
        self._step = CheckStep("waiting", 0, 0, 0.0)
        self._found: list[CheckRow] = []
        self._problem = ""
        self._busy_s = 0.0  # until when presses belong to the check
        self.orb.send(Check(True))

    def page(self) -> Menu:
        """Return what is to be done, or a line for each check, the worst first."""
        words, step = self.words, self._step
        if step.step != "over":
            done = Row((words("check.done", percent=round(100 * step.progress)),))
            live = self.orb.state.link == "live"
            task = rows(words(f"check.{step.step}"), marked=True) if live else self.link_rows()
            return Menu(words("check.title"), [self.back_item()], table=[*task, done])
        items = [self._line(row) for row in self._found]
        items += [self.item("check.again", self._begin), self.back_item()]
        return Menu(words("check.title"), items, notice=self._problem)

    def _line(self, row: CheckRow) -> Item:
        words = self.words
        hint = f"{said(words, row.found)}. {said(words, row.advice)}".strip()
        key = row.verdict.lower().replace(" ", "_")
        name = check_name(words, row.name)
        return Item(name, lambda: None, words(f"check.{key}"), hint=hint)

    def recognised(self, command: Command, time_s: float) -> bool:
        """Keep presses of the check out of the menu."""
        return self._step.step != "over" or time_s < self._busy_s

    def report(self, message: Report, time_s: float) -> None:
        """Take a step or a row of the check, or its refusal."""
        match message:
            case CheckRow():
                self._found.append(message)
                self._found.sort(key=lambda row: _VERDICTS.index(row.verdict))
            case CheckStep():
                self._step, self._busy_s = message, time_s + _AFTER_S
                pressed = message.step == "press"
                self.orb.ghost = self._at(message.row, message.column) if pressed else ()
            case LearnStatus(state=state, text=text) if state == FAILED:
                self._problem = self._stage.told(text)
                self._step = replace(self._step, step="over")

    def tick(self, time_s: float) -> None:
        """Show where on the dome the chosen line's taxel is."""
        super().tick(time_s)
        if self._step.step == "over":
            name = self._found[self.selected].name if self.selected < len(self._found) else ""
            self.orb.ghost = ()
            if isinstance(name, Notice) and name.code in _PLACES:
                self.orb.ghost = self._at(*map(int, name.arguments))

    def _at(self, row: int, column: int) -> tuple[Contact, ...]:
        y = self.orb.state.shape[0] - 1.0 - row
        return (Contact(1, float(column), y, *_GHOST_MM),)

    def leave(self) -> None:
        """End the check."""
        if self._step.step != "over":
            self.orb.send(Check(False))
        super().leave()
