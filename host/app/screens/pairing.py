"""Pairing with a Bluetooth orb: its messages, and the question whether the digits are the same."""

from functools import partial

from host.app.orbs import Orbs
from host.app.screen import Orb, OrbScreen, rows
from tetris.kit.menu import Item, Menu
from tetris.kit.stage import Stage


class PairScreen(OrbScreen):
    """Shows the pairing that is under way."""

    def __init__(self, stage: Stage, orb: Orb, orbs: Orbs) -> None:
        self._orbs = orbs
        super().__init__(stage, orb)

    def page(self) -> Menu:
        """Return its messages, and what can be answered."""
        words, run = self._stage.look.words, self._orbs.pairing
        assert run
        table = [row for said in run.lines[-6:] for row in rows(said)]
        items = []
        if question := run.question:
            asked = words("pair.question", orb=question[0], digits=question[1])
            table += rows(asked, marked=True)
            items += [
                Item(words("pair.same"), partial(run.answer, True)),
                Item(words("pair.different"), partial(run.answer, False)),
            ]
        if run.over:
            if not run.url:
                items.append(Item(words("pair.again"), self._orbs.pair))
            items.append(Item(words("menu.back"), self.leave))
        else:
            items.append(Item(words("pair.cancel"), run.cancel))
        return Menu(words("orbs.pair"), items, table=table)

    def leave(self) -> None:
        """End the pairing, and look for the new orb."""
        run = self._orbs.pairing
        if run is not None:
            run.cancel()
        super().leave()
        self._orbs.scan()
