"""Thresholds chosen on streams: the front is a front, and only thresholds change in the bundle."""

from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.bundles import bundle, container
from controller.bundles.inference.networks import Recognizer
from controller.recognition.debounce import Debouncer, DebounceSettings
from controller.recordings import writer
from controller.recordings.recording import Recording
from controller.shared.event_metric import Answer, Score, judge
from models.__main__ import main
from models.data.ground_truth import GroundTruth
from models.evaluation import replay
from models.evaluation.tune import choose, cost, front, tune
from models.results.evaluation import Point, Tuning
from tests.support.model_commands import refused
from tests.support.pytest_types import Capture, Patch
from tests.support.recordings import of, origin, played

PATH = bundle.default_path(10.0)
SHIPPED = bundle.read(PATH)
LABELS = SHIPPED.labels

some = st.integers(0, 4)


def point(recall: int, alarms: int, late: int) -> Point:
    return Point(DebounceSettings(0.5, 0.8, 0.2), recall / 4, recall / 4, float(alarms), late / 10)


POINTS = st.lists(st.builds(point, some, some, some), min_size=1, max_size=12)


def beats(one: Point, other: Point) -> bool:
    """Whether a point is at least as good in everything, and better in something."""
    a = (one.recall, -one.false_alarms_per_min, -one.latency_s)
    b = (other.recall, -other.false_alarms_per_min, -other.latency_s)
    return all(x >= y for x, y in zip(a, b, strict=True)) and a != b


@settings(deadline=None)
@given(POINTS)
def test_the_front_is_what_no_other_point_beats(points: list[Point]) -> None:
    edge = front(points)
    for point in points:
        beaten = any(beats(other, point) for other in points)
        on_it = any(astuple(point)[1:] == astuple(kept)[1:] for kept in edge)
        assert on_it == (not beaten)
    assert [p.latency_s for p in edge] == sorted(p.latency_s for p in edge)


def test_what_is_late_is_chosen_only_where_nothing_else_is_left(monkeypatch: Patch) -> None:
    fast = Point(DebounceSettings(1.0, 0.5, 0.1), 0.7, 0.70, 0.5, 0.2)
    good = Point(DebounceSettings(0.5, 0.8, 0.2), 0.99, 0.99, 0.01, 0.4)
    late = Point(DebounceSettings(0.2, 0.95, 0.2), 1.0, 1.0, 0.0, 0.6)
    points = [fast, good, late]
    assert choose(points, points, 1000) == good
    monkeypatch.setattr("models.evaluation.tune.LATEST_S", 0.1)
    assert choose(points, points, 1000) == fast
    monkeypatch.setattr("models.evaluation.tune.LATEST_S", 1.0)
    assert choose(points, points, 1000) == late
    monkeypatch.setattr("models.evaluation.tune.WAIT", 1000.0)
    assert choose(points, points, 1000) == fast


def test_of_two_points_alike_the_one_with_good_neighbours_is_chosen(monkeypatch: Patch) -> None:
    lucky = Point(DebounceSettings(0.2, 0.5, 0.4), 1.0, 1.0, 0.0, 0.3)
    around = Point(DebounceSettings(0.25, 0.5, 0.4), 0.8, 0.8, 0.0, 0.3)
    safe = Point(DebounceSettings(0.6, 0.8, 0.2), 1.0, 1.0, 0.0, 0.31)
    beside = Point(DebounceSettings(0.7, 0.8, 0.2), 1.0, 1.0, 0.0, 0.32)
    points = [lucky, around, safe, beside]
    assert choose([lucky, safe], points, 1000) == safe
    monkeypatch.setattr("models.evaluation.tune.WAIT", 100.0)
    assert choose([lucky, safe], points, 1000) == lucky  # faster, and sure of it


@pytest.fixture(scope="module")
def found() -> Tuning:
    return tune(LABELS, SHIPPED.debounce, _streams())


def _streams() -> list[replay.Stream]:
    networks = Recognizer(SHIPPED)
    recordings = [played(preset, seed=2) for preset in ("nominal", "paper-snr")]
    return [replay.run(SHIPPED, networks, r, GroundTruth.of(r, LABELS, "it")) for r in recordings]


def test_a_point_is_what_the_debouncer_gives_at_these_thresholds(found: Tuning) -> None:
    for point in (found.before, found.chosen, found.front[0]):
        total, chosen = Score(), point.settings
        for stream in _streams():
            debouncer = Debouncer(LABELS, chosen)
            levels = stream.idle, stream.levels
            steps = zip(stream.truth.t.tolist(), stream.probabilities, *levels, strict=True)
            fired = [(t, debouncer.step(*newest)) for t, *newest in steps]
            answers = [Answer(t, label) for t, label in fired if label]
            total.add(judge(stream.truth.events, answers))
        assert point.recall == total.recall
        assert point.f1 == total.f1
        assert point.latency_s == pytest.approx(np.median(total.latencies_s), abs=1e-4)
    assert found.before.settings == SHIPPED.debounce
    assert cost(found.chosen) <= cost(found.before) + 100.0 / found.events


def test_streams_without_gestures_are_refused() -> None:
    idle = of(np.full((30, 5, 5), 40.0), label=[0] * 30)
    known = GroundTruth.of(idle, LABELS, "it")
    stream = replay.run(SHIPPED, Recognizer(SHIPPED), idle, known)
    with pytest.raises(ValueError, match="no gestures"):
        tune(LABELS, DebounceSettings(), [stream])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording whose seed anybody may use."""
    where = tmp_path_factory.mktemp("data")
    own: Recording = played("nominal", seed=3)
    free = replace(own, origin=replace(own.origin, seed=3))
    writer.write_beside(where / "one.npz", writer.pack(free))
    return where


def chosen(folder: Path, out: Path) -> list[str]:
    """Words of the command that chooses thresholds anew."""
    return ["train", str(folder), "--from", str(PATH), "--epochs", "0", "--out", str(out)]


@pytest.mark.train
def test_a_tuned_bundle_differs_in_its_thresholds_only(
    folder: Path, tmp_path: Path, capsys: Capture
) -> None:
    out = tmp_path / "tuned.orb"
    assert main(chosen(folder, out)) == 0
    told = capsys.readouterr().out
    assert "chosen" in told
    assert "false alarms" in told
    tuned = bundle.read(out)
    Recognizer(tuned)  # the golden vectors still hold
    old, new = (container.unpack(path.read_bytes()) for path in (PATH, out))
    changed = {name for name in old if old[name] != new[name]}
    assert changed == {container.MANIFEST, container.SUMS}
    assert "1 recording" in tuned.card["tuned"]
    same = replace(tuned, debounce=SHIPPED.debounce, card=SHIPPED.card, hash=SHIPPED.hash)
    assert same.mapping == SHIPPED.mapping
    assert same.preprocess == SHIPPED.preprocess
    assert same.labels == SHIPPED.labels


def test_no_epochs_need_a_bundle_to_keep(tmp_path: Path, capsys: Capture) -> None:
    words = ["train", tmp_path, "--epochs", "0", "--out", tmp_path / "x.orb"]
    assert "--epochs 0 trains nothing; add --from BUNDLE" in refused(capsys, *words)


@pytest.mark.train
def test_seeds_for_tests_are_refused_in_one_sentence(tmp_path: Path, capsys: Capture) -> None:
    writer.write_beside(tmp_path / "one.npz", writer.pack(played("nominal", seed=3)))
    assert "for tests only" in refused(capsys, *chosen(tmp_path, tmp_path / "x.orb"))


@pytest.mark.train
def test_recordings_of_another_sensor_are_one_sentence(tmp_path: Path, capsys: Capture) -> None:
    small = of(np.full((60, 4, 4), 40.0), origin(4, 4), label=[0] * 30 + [1] * 30)
    writer.write_beside(tmp_path / "small.npz", writer.pack(small))
    for words in (chosen(tmp_path, tmp_path / "x.orb"), ["evaluate", str(PATH), str(tmp_path)]):
        assert main(words) == 2
        lines = capsys.readouterr().err.splitlines()
        assert "4×4 sensor" in lines[-1]
