"""Descriptions of sensors: those that ship are read, and every mistake is told with its line."""

from pathlib import Path

import pytest

from controller.sensors.geometry import Geometry, SensorError
from controller.sensors.hardware.description import Description, affordable, read
from tests.support import ROOT
from tests.support.described import described

SHIPPED = sorted((ROOT / "firmware").glob("*/*.toml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_the_descriptions_of_the_sketches_are_read(path: Path) -> None:
    found = read(path, "lines")
    assert found.rows * found.columns <= found.length
    assert described(found.text()) == found


def test_every_sketch_has_a_description_and_few_lines() -> None:
    sketches = sorted((ROOT / "firmware").glob("*/*.ino"))
    assert [path.stem for path in sketches] == ["esp32_touch", "mpr121", "muca", "trill"]
    for path in sketches:
        assert path.with_suffix(".toml") in SHIPPED
        assert len(path.read_text().splitlines()) <= 60


def test_what_is_not_named_is_usual() -> None:
    mine = described("rows = 3\ncolumns = 4\n")
    assert mine.geometry == Geometry(3, 4, 10.0)
    assert (mine.signal.unit, mine.signal.sign, mine.length) == ("counts", -1, 12)
    assert Description().gridded(9).geometry == Geometry(3, 3, 10.0)
    assert Description().gridded(10).geometry == Geometry(1, 10, 10.0)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("rows = 3\n", "mine.toml, line 1 needs rows and columns"),
        ("rows = 3\ncolumns = 4\nsign = 'up'\n", "line 3 has sign = 'up'; expected is one of"),
        ("rows = 1\ncolumns = 3\norder = [0, 1]\n", "line 3 has an order of 2 values for 3 taxels"),
        ("rows = 1\ncolumns = 2\norder = [0, 0]\n", "line 3 has order = .* expected is a list"),
        (
            "rows = 1\ncolumns = 2\norder = [0, 5]\nvalues = 4\n",
            "values = 4, but its taxels need 6",
        ),
        ("rows = 90\ncolumns = 90\n", "has 8100 taxels; 4096 are allowed"),
        ("rows = \n", "mine.toml, line 1: invalid value"),
        ("colour = 1\n", "line 1 has the unknown key 'colour'"),
    ],
)
def test_mistakes_are_told_with_their_line(text: str, sentence: str) -> None:
    with pytest.raises(SensorError, match=sentence):
        described(text)


@pytest.mark.parametrize(
    ("own_hz", "wanted_hz", "read_hz"),
    [(40.0, 40.0, 40.0), (36.0, 40.0, 40.0), (100.0, 10.0, 10.0), (9.0, 10.0, 10.0)],
)
def test_a_sensor_is_read_as_often_as_it_is_wanted_where_it_comes_close(
    own_hz: float, wanted_hz: float, read_hz: float
) -> None:
    assert affordable(own_hz, wanted_hz) == read_hz
