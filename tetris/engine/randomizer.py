"""Randomizer of pieces: docs/tetris.md "randomizer"."""

from random import Random
from typing import Final

from tetris.engine.pieces import KINDS, Kind
from tetris.engine.rules import Randomiser


class Randomizer:
    """Deals pieces from a seed.

    Attributes:
        drawn: Random numbers used so far. With the seed, this is all there is to know.
    """

    __slots__ = ("_randomiser", "_source", "drawn", "seed")

    def __init__(self, seed: int, randomiser: Randomiser = "7-bag") -> None:
        self.seed: Final = seed
        self._randomiser = randomiser
        self._source = Random(seed)
        self.drawn = 0

    def deal(self) -> list[Kind]:
        """Return the next pieces: a shuffled bag of all seven, or one of any kind."""
        # random() alone is promised to give the same numbers in every Python version.
        number = self._source.random
        if self._randomiser == "uniform":
            self.drawn += 1
            return [KINDS[int(number() * len(KINDS))]]
        self.drawn += len(KINDS)
        return sorted(KINDS, key=lambda _: number())

    def rewind(self, drawn: int) -> None:
        """Go to where so many random numbers have been used."""
        if drawn < self.drawn:
            self._source = Random(self.seed)
            self.drawn = 0
        for _ in range(drawn - self.drawn):
            self._source.random()
        self.drawn = drawn
