"""Progress of a training on a terminal."""

import io
import math

import pytest

pytest.importorskip("torch", reason="needs the [train] extra")

from models.results.training import Epoch
from models.training import progress

pytestmark = pytest.mark.train


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


def epochs(count: int) -> list[Epoch]:
    return [Epoch(i + 1, 1.0 / (i + 1), 0.5, 1.0 / (i + 1), 0.5, 0.5) for i in range(count)]


def play(stream: io.StringIO) -> str:
    """Two epochs of two batches, a second each."""
    clock = iter(range(100))
    show = progress.watch("CNN", 2, lambda e: f"loss {e.loss:.2f}", stream, lambda: next(clock))
    for number in range(2):
        show(epochs(number), 0.5)
        show(epochs(number), 1.0)
        show(epochs(number + 1), 0.0)
    return stream.getvalue()


def test_a_curve_is_as_high_as_its_numbers() -> None:
    assert progress.sparkline([0, 1, 2, 3, 4, 5, 6, 7]) == "▁▂▃▄▅▆▇█"
    assert progress.sparkline([3.0, 3.0]) == "▁▁"
    assert progress.sparkline([0.0, math.nan, 1.0]) == "▁ █"
    assert progress.sparkline([math.nan]) == ""


def test_a_long_curve_is_thinned_out_and_keeps_its_ends() -> None:
    drawn = progress.sparkline([float(i) for i in range(1000)], 10)
    assert len(drawn) == 10
    assert (drawn[0], drawn[-1]) == ("▁", "█")


def test_a_file_gets_a_line_for_each_epoch() -> None:
    assert play(io.StringIO()) == "CNN epoch 1/2: loss 1.00\nCNN epoch 2/2: loss 0.50\n"


def test_a_terminal_gets_one_line_that_grows() -> None:
    text = play(Terminal())
    assert text.count("\n") == 1
    assert text.endswith("\n")
    last = text.rsplit("\x1b[2K", 1)[-1]
    assert last.startswith("CNN 2.0/2 █▁ loss 0.50")
