"""The orbs: which there are, the one that is connected, and what can be done with it."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

from controller.shared.errors import UserError
from controller.shared.files import data_folder
from controller.shared.protocol.messages import Report
from controller.shared.protocol.teaching import Describe, Recalibrate, Vocabulary
from host.app.orbs import OrbEntry, Orbs
from host.app.programs import Programs, folder
from host.app.screen import Orb, OrbScreen, rows
from host.app.screens.check import CheckScreen
from host.app.screens.pairing import PairScreen
from host.app.screens.phone import PhoneScreen
from host.app.screens.programs import ProgramsScreen
from host.connection import bundle_upload
from host.ui.naming import said
from tetris.kit.menu import Item, Menu, Row
from tetris.kit.stage import Stage

_HASH: Final = re.compile(r"[0-9a-f]{16}")  # name of an installed bundle


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
        """Return the list, and what can be done."""
        words = self._stage.look.words
        items = [self._choice(entry) for entry in self.orbs.entries()]
        searching = self.orbs.scanning
        items.append(
            Item(
                words("orbs.searching" if searching else "orbs.search"),
                self.orbs.scan,
                hint=words("orbs.search_hint"),
            )
        )
        items += [*self._pages(), Item(words("menu.back"), self.leave)]
        return Menu(words("orbs.title"), items, table=self._state(), notice=self.orbs.notice)

    def _choice(self, entry: OrbEntry) -> Item:
        words = self._stage.look.words
        name = (entry.name or entry.device_id) if entry.device_id else words("orbs.virtual")
        if self.orbs.present(entry):
            value = words(f"orbs.link_{self.orb.state.link}")
        else:
            value = words("orbs.here") if entry.here else entry.seen[:10]
        hint = words("orbs.own_hint") if not entry.device_id else f"{entry.device_id}, {entry.port}"
        return Item(name, partial(self.orbs.choose, entry), value, hint=hint)

    def _pages(self) -> list[Item]:
        """Return what can be done with the present orb, and with others."""
        words, stage = self._stage.look.words, self._stage
        items = [Item(words("orbs.pair"), self._pair, hint=words("orbs.pair_hint"))]
        if self.orb.state.link == "live":
            show = partial(PresentOrbScreen, stage, self.orb, self.orbs)
            items.append(
                Item(words("orb.title"), lambda: stage.push(show()), hint=words("orb.hint"))
            )
        phone = partial(PhoneScreen, stage, self.orb)
        control = partial(ProgramsScreen, stage, self.orb, self._programs, folder())
        return [
            *items,
            Item(words("phone.title"), lambda: stage.push(phone()), hint=words("phone.hint")),
            Item(
                words("programs.title"),
                lambda: stage.push(control()),
                hint=words("programs.hint"),
            ),
            Item(words("lab.title"), self._show_lab, hint=words("lab.hint")),
        ]

    def _pair(self) -> None:
        self.orbs.pair()
        self._stage.push(PairScreen(self._stage, self.orb, self.orbs))

    def _state(self) -> list[Row]:
        """Return how the present orb is, in a line or two."""
        state, words = self.orb.state, self._stage.look.words
        if state.link != "live":
            return rows(state.reason or words(f"orbs.link_{state.link}"))[:2]
        return []


class PresentOrbScreen(OrbScreen):
    """The connected orb: its state, its health, its rest image, its skin, its gestures."""

    def __init__(self, stage: Stage, orb: Orb, orbs: Orbs) -> None:
        """Show it, and ask it what it knows."""
        self._orbs = orbs
        self._bundle: Vocabulary | None = None
        super().__init__(stage, orb)
        orb.send(Describe())

    def page(self) -> Menu:
        """Return its state, and what can be done."""
        words, stage = self._stage.look.words, self._stage
        check = partial(CheckScreen, stage, self.orb)
        install = partial(InstallScreen, stage, self.orb, self._orbs)
        items = [
            Item(
                words("orb.rest"), lambda: self.orb.send(Recalibrate()), hint=words("orb.rest_hint")
            ),
            Item(words("check.title"), lambda: stage.push(check()), hint=words("check.hint")),
            Item(words("install.title"), lambda: stage.push(install()), hint=words("install.hint")),
            Item(words("menu.back"), self.leave),
        ]
        return Menu(words("orb.title"), items, table=self._state())

    def _state(self) -> list[Row]:
        """Return how it is, in lines."""
        words, state = self._stage.look.words, self.orb.state
        if state.link != "live" or state.welcome is None:
            return rows(state.reason or words(f"orbs.link_{state.link}"))
        lines = [Row((words("orb.state"), f"{state.welcome.name}, {state.rate_hz:.0f} Hz"))]
        if not state.ready:
            lines += rows(words("orb.resting"), marked=True)
        if self._bundle is not None:
            lines.append(Row((words("orb.bundle"), self._gestures(self._bundle))))
        if state.sure:
            lines.append(Row((words("orb.user"), state.user or words("orb.unknown"))))
        found = [row for one in state.health for row in rows(said(words, one))]
        return lines + (found or [Row((words("orb.health"), words("orb.healthy")))])

    def _gestures(self, bundle: Vocabulary) -> str:
        """Return a bundle's name for people, with the number of taught gestures."""
        words, name = self._stage.look.words, bundle.bundle
        if _HASH.fullmatch(name):
            name = words("orb.installed")
        name = name or words("orb.shipped")
        if not bundle.taught:
            return name
        key = "orb.taught_one" if bundle.taught == 1 else "orb.taught_more"
        return f"{name}, {words(key, count=bundle.taught)}"

    def report(self, message: Report, time_s: float) -> None:
        """Take what the orb says of its gestures."""
        if isinstance(message, Vocabulary):
            self._bundle = message


class InstallScreen(OrbScreen):
    """Lists the bundles of the data folder, and sends the orb one."""

    def __init__(self, stage: Stage, orb: Orb, orbs: Orbs) -> None:
        """Show the bundles that there are now."""
        self._orbs, self._problem = orbs, ""
        self._files = bundles(data_folder())
        super().__init__(stage, orb)

    def page(self) -> Menu:
        """Return the files, and how the upload goes."""
        words = self._stage.look.words
        items = [
            Item(path.stem, partial(self._install, path), hint=str(path)) for path in self._files
        ]
        table = self._progress()
        if not self._files:
            table = rows(words("install.none", folder=data_folder()))
        items.append(Item(words("menu.back"), self.leave))
        return Menu(words("install.title"), items, table=table, notice=self._problem)

    def _install(self, path: Path) -> None:
        upload = self._orbs.upload
        if upload is not None and not upload.over:
            return
        try:
            self._orbs.install(bundle_upload.load(path), self._stage.time_s)
        except UserError as error:
            self._problem = str(error)

    def _progress(self) -> list[Row]:
        words, upload = self._stage.look.words, self._orbs.upload
        if upload is None:
            return []
        if upload.over:
            return rows(said(words, bundle_upload.outcome(upload)))
        share = f"{upload.offset / upload.size:.0%}"
        return [Row((words(f"install.{upload.stage}"), share))]


def bundles(where: Path) -> list[Path]:
    """Return the bundles in a folder and in its folder "bundles", by name."""
    return sorted([*where.glob("*.orb"), *where.glob("bundles/*.orb")])
