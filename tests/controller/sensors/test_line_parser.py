"""Lines of numbers: separators, headers, and what is left of cut, doubled and garbled ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller.sensors.lines import MAX_LINE, LineParser

NUMBERS = st.lists(st.integers(-4096, 4096), min_size=3, max_size=3)


def parsed(data: bytes, count: int = 3) -> list[list[float]]:
    """The frames in data that begins with a line."""
    return [frame.tolist() for frame in LineParser(count).feed(b"\n" + data)]


@pytest.mark.parametrize(
    "line", [b"1,2,3", b"1 2 3", b"1\t2\t3", b"1;2;3", b" 1, 2, 3,", b"1.0  2e0 +3\r", b"1;2;3;"]
)
def test_separators_are_found_out(line: bytes) -> None:
    assert parsed(line + b"\n") == [[1.0, 2.0, 3.0]]


@pytest.mark.parametrize(
    "line",
    [b"a,b,c", b"Trill ready", b"1,2", b"1,2,3,4", b"1,2,3 4", b"1,2,x", b"1,2,nan", b"1,2,1e99"],
)
def test_headers_and_other_lines_are_no_frames(line: bytes) -> None:
    assert parsed(line + b"\n4,5,6\n") == [[4.0, 5.0, 6.0]]


def test_the_length_is_found_out_from_two_lines_that_agree() -> None:
    parser = LineParser()
    assert parser.feed(b"7,8\nt0,t1,t2\n1,2\n1,2,3\n4,5,6\n7,8\n") != []
    assert (parser.count, parser.frames) == (3, 1)


def test_the_first_line_is_not_trusted_since_it_may_be_cut() -> None:
    assert [f.tolist() for f in LineParser(3).feed(b"41,2,3\n4,5,6\n")] == [[4.0, 5.0, 6.0]]


def test_after_a_loss_of_the_port_the_first_line_may_be_cut_again() -> None:
    parser = LineParser(3)
    parser.feed(b"\n1,2,3\n4,5")
    parser.cut()
    assert [f.tolist() for f in parser.feed(b"51,8,9\n7,8,9\n")] == [[7.0, 8.0, 9.0]]


def test_a_missing_value_is_the_last_one_of_its_taxel() -> None:
    assert parsed(b"1,2,3\n4,,6\n,5,6\n") == [[1, 2, 3], [4, 2, 6], [4, 5, 6]]
    assert parsed(b",2,3\n4,5,6\n") == [[4, 5, 6]]  # there is none before the first


def test_a_line_without_an_end_is_not_kept() -> None:
    parser = LineParser(3)
    parser.feed(b"\n" + b"1," * MAX_LINE)
    parser.feed(b"2,3\n4,5,6\n")
    assert parser.latest is not None
    assert (parser.frames, parser.latest.tolist()) == (1, [4.0, 5.0, 6.0])


@given(st.lists(NUMBERS, min_size=1, max_size=8), st.data())
def test_it_does_not_matter_how_the_bytes_are_cut(
    frames: list[list[int]], data: st.DataObject
) -> None:
    text = b"\n" + b"".join(b",".join(b"%d" % v for v in f) + b"\r\n" for f in frames)
    places = sorted(data.draw(st.lists(st.integers(0, len(text)), max_size=6)))
    parser, found = LineParser(3), []
    for first, end in zip([0, *places], [*places, len(text)], strict=True):
        found += parser.feed(text[first:end])
    assert [f.tolist() for f in found] == frames


@given(NUMBERS, NUMBERS, st.integers(0, 40), st.integers(0, 40))
def test_a_cut_or_doubled_line_costs_itself_only(
    one: list[int], two: list[int], first: int, end: int
) -> None:
    line = b",".join(b"%d" % value for value in one)
    hurt = line[:first] + line[end:]  # a piece is missing, or comes twice
    found = parsed(hurt + b"\n" + b",".join(b"%d" % value for value in two) + b"\n")
    assert found[-1] == two
    assert len(found) <= 2


@given(st.binary(max_size=300), NUMBERS)
def test_garbage_raises_nothing_and_the_next_line_is_read(noise: bytes, frame: list[int]) -> None:
    parser = LineParser(3)
    found = parser.feed(noise)
    assert all(f.shape == (3,) and np.isfinite(f).all() for f in found)
    line = b"\n" + b" ".join(b"%d" % value for value in frame) + b"\n"
    assert parser.feed(line)[-1].tolist() == frame
