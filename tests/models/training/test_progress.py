"""Progress of a training on a terminal."""

import io

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


def test_a_file_gets_a_line_for_each_epoch() -> None:
    assert play(io.StringIO()) == "CNN epoch 1/2: loss 1.00\nCNN epoch 2/2: loss 0.50\n"


def test_a_terminal_gets_one_line_that_grows() -> None:
    text = play(Terminal())
    assert text.count("\n") == 1
    assert text.endswith("\n")
    last = text.rsplit("\x1b[2K", 1)[-1]
    assert last.startswith("CNN 2.0/2 loss 0.50")
