"""Cards have what was found out, and no more; their drawings are files beside them."""

import math
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest

from controller.bundles import bundle
from models import formatting
from models.reports import cards
from models.results.training import Calibration, ClassRow, Epoch, HeldOutScore, Training
from tests.support.report_results import training

SHIPPED = bundle.read(bundle.default_path())


def card(found: Training) -> str:
    return cards.training(SHIPPED, found)


def test_the_honest_figure_and_the_papers_stand_side_by_side_with_the_gap() -> None:
    said = card(training())
    assert "| right windows | 91.20 % (90.00–92.00) | 97.90 % | 6.7 points |" in said
    assert "| position error, grid units | 0.120 (0.110–0.130) | 0.080 | 0.040 |" in said
    assert "| right outputs (“binary”) | 94.13 % | 98.60 % |" in said  # as the paper may count


def test_what_could_not_be_had_is_a_dash_and_never_nan() -> None:
    nan = HeldOutScore(math.nan, math.nan, math.nan, math.nan)
    gesture, location = training().gesture, training().location
    assert gesture is not None
    assert location is not None
    bare = training(
        classes=(ClassRow("press", 3, 2.0, math.nan, math.nan),),
        gesture=replace(gesture, honesty=nan, event_accuracy=math.nan),
        location=replace(location, honesty=nan),
    )
    said = card(bare)
    assert "nan" not in said.split()
    assert f"| {formatting.NONE} |" in said


def test_drawings_are_complete_and_the_same_every_time(tmp_path: Path) -> None:
    figures = pytest.importorskip("models.reports.figures", reason="needs the [plot] extra")
    once = figures.draw_training(training(), tmp_path / "my.orb")
    names = ["my-gestures.svg", "my-calibration.svg", "my-places.svg", "my-touches.svg"]
    assert [path.name for path in once] == names
    assert all(ElementTree.parse(path).getroot().tag.endswith("svg") for path in once)
    drawn = [path.read_bytes() for path in once]
    assert b"learned" in drawn[0]  # text stays text
    again = figures.draw_training(training(), tmp_path / "my.orb")
    assert [path.read_bytes() for path in again] == drawn
    said = cards.training(SHIPPED, training(), once)
    assert said.endswith("![my-touches](my-touches.svg)")


def test_what_is_not_known_is_drawn_as_nothing(tmp_path: Path) -> None:
    figures = pytest.importorskip("models.reports.figures", reason="needs the [plot] extra")
    gesture, location = training().gesture, training().location
    assert gesture is not None
    assert location is not None
    epochs = (Epoch(1, 0.5, 0.8, math.nan, math.nan, math.nan),)
    calibration = Calibration(1.0, math.nan, math.nan, ())
    bare = training(
        gesture=replace(gesture, epochs=epochs, calibration=calibration),
        location=replace(location, epochs=epochs, touches=()),
    )
    assert len(figures.draw_training(bare, tmp_path / "my.orb")) == 4
    assert figures.draw_training(training(gesture=None, location=None), tmp_path / "my.orb") == []
