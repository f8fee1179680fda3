"""People on other sensors, as they are recorded: odd clocks, held touches, falling signals.

The touches are known, so what is felt is compared with them.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from controller.cli import recordings as command
from controller.recordings import importer, reader
from controller.recordings.description import Description
from controller.recordings.description import described as read_description
from controller.recordings.quality import check, taxels
from controller.recordings.quality.check import Level
from controller.recordings.quality.taxels import respond
from controller.recordings.recording import Recording, RecordingError
from controller.shared.taxel_measures import TaxelFault
from tests.support.other_sensors import NAMES, Sensor, bursts, recorded, ticks

Clock = Callable[[np.ndarray[Any, Any]], np.ndarray[Any, Any]]
SCREEN: dict[str, Any] = {"rate_hz": 14.04, "rows": 27, "columns": 15, "finger": 1.0}
FALLING: dict[str, Any] = {"level": 30_000.0, "change": -210.0, "noise": 4.0}  # 0.7 %
HELD: dict[str, Any] = {"hold_s": 10.0, "touches": 6}


TOML = """
frames = "frames"
unit = "counts"
pitch_mm = 5
time = "t"
label = "label"
label_names = ["rest", "tap", "hold"]
null = "rest"
subject = "who"  # one number for all frames of a file
"""


def described(**keys: Any) -> Description:
    usual = {"frames": "frames", "unit": "counts", "pitch_mm": 5.0, "time": "t", "label": "label",
             "label_names": NAMES, "null": "rest", "labeller": "cue"}  # fmt: skip
    return Description(**{**usual, **keys})


def imported(sensor: Sensor, clock: Clock = lambda true_s: true_s, **keys: Any) -> Recording:
    arrays = recorded(sensor, 1)
    [made] = importer.recordings({**arrays, "t": clock(arrays["t"])}, described(**keys))
    return made


@pytest.mark.parametrize("rate_hz", [9.0, 14.04, 23.7, 40.0, 43.0])
@pytest.mark.parametrize("clock", [lambda true_s: true_s, ticks, bursts])
@pytest.mark.parametrize("even", [False, True])
def test_the_rate_is_frames_over_time(rate_hz: float, clock: Clock, even: bool) -> None:
    made = imported(Sensor(rate_hz=rate_hz), clock, even_times=even)
    report = check.examine(Path("x.npz"), made)
    assert made.origin.rate_hz == pytest.approx(rate_hz, rel=0.01)
    assert made.rate_hz == pytest.approx(rate_hz, rel=0.01)
    assert report.seconds == pytest.approx(len(made.t) / rate_hz, rel=0.02)
    assert sum(report.said[0].seconds.values()) == pytest.approx(report.seconds, rel=0.02)


def test_a_given_rate_holds_with_even_times_and_pauses_stay() -> None:
    arrays = recorded(Sensor(), 1)
    t = ticks(arrays["t"]) + np.where(arrays["t"] > 10.0, 60.0, 0.0)
    keys = {"rate_hz": 40.0, "even_times": True, "gap_s": 0.5}
    [made] = importer.recordings({**arrays, "t": t}, described(**keys))
    assert made.rate_hz == pytest.approx(40.0)
    steps = np.diff(made.t)
    assert (np.diff(made.sequence) > 1).sum() == 1
    assert steps.max() == pytest.approx(60.0, abs=0.1)
    assert np.delete(steps, steps.argmax()) == pytest.approx(1 / 40.0)
    assert check.examine(Path("x.npz"), made).seconds == pytest.approx(made.t[-1] - 60, abs=0.1)


@pytest.mark.parametrize(
    "sensor",
    [
        Sensor(),
        Sensor(**HELD),
        Sensor(**HELD, stray=0.0, finger=4.0),  # the same place again and again
        Sensor(**FALLING),
        Sensor(**FALLING, **HELD, begins_touched=True),
        Sensor(**SCREEN),  # a finger is 2 % of the mean of a flat hand
        Sensor(**SCREEN, **HELD),
        Sensor(rate_hz=9.0, level=-50.0),
        Sensor(pause_s=30.0, touches=5),
        Sensor(noise=25.0),
    ],
)
def test_touches_are_felt_and_nothing_else_is(sensor: Sensor) -> None:
    made = imported(sensor)
    response, true = respond(made), made.cue > 0
    assert response.touched[true].mean() > 0.92  # faint at both ends
    assert (~response.touched)[~true].mean() > 0.99
    hand = np.median(response.change[(made.cue == 2) & response.touched])
    assert np.sign(hand) == np.sign(sensor.change)
    assert check.examine(Path("x.npz"), made).level is Level.GOOD


def test_a_taxel_that_never_reacts_between_touches_around_it_is_still_dead() -> None:
    arrays = recorded(Sensor(touches=40, finger=1.5), 1)
    noise = np.random.default_rng(2).normal(0.0, 2.0, len(arrays["t"]))
    arrays["frames"][:, 3, 2] = np.rint(noise)
    [made] = importer.recordings(arrays, described())
    [finding] = check.examine(Path("x.npz"), made).findings
    assert finding.text.startswith("taxel row 3, column 2: dead")


def test_a_taxel_that_responds_in_its_own_way_is_not_dead() -> None:
    """An electrode beside others rises under one gesture and falls under the other."""
    arrays = recorded(Sensor(touches=40, finger=1.5), 1)
    own = 200.0 * np.sin(np.arange(len(arrays["t"])) / 3.0) * (arrays["label"] > 0)
    arrays["frames"][:, 3, 2] = np.rint(own + np.random.default_rng(2).normal(0.0, 2.0, len(own)))
    [made] = importer.recordings(arrays, described())
    assert check.examine(Path("x.npz"), made).level is Level.GOOD


def test_no_recording_fails_for_dead_taxels(monkeypatch: pytest.MonkeyPatch) -> None:
    half = np.arange(24).reshape(6, 4) % 2 == 0
    monkeypatch.setattr(taxels, "examine", lambda *_: [TaxelFault("dead", half, "dead")])
    assert check.examine(Path("x.npz"), imported(Sensor())).level is Level.DOUBTFUL


@pytest.mark.parametrize("rest", ["frames", "untouched"])
def test_the_rest_is_imported(rest: str) -> None:
    sensor = Sensor(**FALLING)
    arrays = recorded(sensor, 1) | {"untouched": np.full(24, 30_000)}
    [made] = importer.recordings(arrays, described(rest=rest))
    expected = arrays["frames"][0] if rest == "frames" else np.full((6, 4), 30_000)
    assert made.rest is not None
    assert (made.rest == expected).all()
    assert respond(made).touched[made.cue > 0].mean() > 0.92


def test_places_marks_and_users_are_imported() -> None:
    arrays = recorded(Sensor(touches=4), 1)
    arrays["said"] = np.where(arrays["t"] < 3.0, "", "tired")
    keys = {"place": "place", "marks": "said", "user": "ada", "label": "label"}
    [made] = importer.recordings(arrays, described(**keys))
    assert made.origin.user == "ada"
    cues = [mark for mark in made.marks if mark.kind == "cue"]
    first = int((arrays["label"] > 0).argmax())
    x, y = arrays["place"][first]
    assert cues[0].text == f"go tap at {x:.3f},{y:.3f}"
    assert cues[0].t_s == pytest.approx(made.t[first])
    assert len(cues) == 4
    assert [mark.text for mark in made.marks if mark.kind == "note"] == ["tired"]
    one = arrays | {"who": np.array(7)}  # a number for all frames
    [made] = importer.recordings(one, described(subject="who"))
    assert made.origin.user == "07"


@pytest.mark.parametrize(
    ("arrays", "keys", "complaint"),
    [
        ({"untouched": np.zeros(7)}, {"rest": "untouched"}, r"float64 \(7,\), not a frame"),
        ({"untouched": np.full((6, 4), np.nan)}, {"rest": "untouched"}, "are no numbers"),
        ({"place": np.zeros(9)}, {"place": "place"}, "not x and y for each"),
    ],
)
def test_wrong_rest_and_places_are_told(
    arrays: dict[str, Any], keys: dict[str, Any], complaint: str
) -> None:
    with pytest.raises(ValueError, match=complaint):
        list(importer.recordings(recorded(Sensor(), 1) | arrays, described(**keys)))


def test_many_files_are_imported_and_a_bad_one_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for number in (1, 2):
        arrays = recorded(Sensor(touches=2), number)
        np.savez(tmp_path / f"{number}.npz", who=np.array(number), **arrays)  # type: ignore[arg-type]
    (tmp_path / "3.npz").write_bytes(b"nothing")
    told = tmp_path / "sensor.toml"
    told.write_text(TOML)
    sources = [str(tmp_path / f"{number}.npz") for number in (1, 2, 3)]
    status = command.main(["import", *sources, str(told), "--out", str(tmp_path / "made")])
    made = sorted((tmp_path / "made").glob("*.npz"))
    assert status == 1
    assert [reader.load(path).origin.user for path in made] == ["01", "02"]
    assert f"{sources[2]} is left out: " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("sensor", "sign"), [(Sensor(), 1), (Sensor(**FALLING), -1), (Sensor(**SCREEN), 1)]
)
def test_what_a_touch_does_to_the_readings_is_found_out_or_taken_as_given(
    sensor: Sensor, sign: int
) -> None:
    assert imported(sensor).origin.sign == sign
    assert imported(sensor, sign="falls").origin.sign == -1
    assert imported(sensor, sign="rises").origin.sign == 1
    unlabelled = imported(sensor, label="", label_names=(), null="")
    assert unlabelled.origin.sign == sign
    above = replace(sensor, level=max(sensor.level, 500.0))
    assert imported(above, unit="pF").origin.sign == sign  # self-capacitance rises


RISES, FALLS = {"level": 500.0, "change": 200.0}, {"level": 900.0, "change": -200.0}


@pytest.mark.parametrize(
    ("sensor", "unit", "scale", "keys", "expected"),
    [
        (RISES, "pF", 1.0, {}, 1),
        (FALLS, "pF", 1.0, {}, -1),
        (RISES, "counts", 1.0, {}, 1),
        (FALLS, "kOhm", 1.0, {}, -1),
        (RISES, "pF", 1e3, {"time_unit": "ms"}, 1),
        (FALLS, "counts", 1e6, {"time_unit": "us"}, -1),
        (RISES, "pF", 1e3, {}, r"0\.04 frames a second if it is in s; .* say time_unit = \"ms\""),
        (FALLS, "pF", 1e6, {"rate_hz": 40.0}, r"say time_unit = \"us\""),
        (RISES, "counts", 1.0, {"time_unit": "ms"}, 'say time_unit = "s"'),
        (RISES, "counts", 1.0, {"rate_hz": 0.025}, "a period of 0.025 s is rate_hz = 40"),
    ],
)
def test_skins_of_any_sign_unit_and_rate_are_imported_or_refused_in_a_sentence(
    sensor: dict[str, Any], unit: str, scale: float, keys: dict[str, Any], expected: int | str
) -> None:
    def clock(true_s: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        return true_s * scale

    if isinstance(expected, str):
        with pytest.raises(ValueError, match=expected):
            imported(Sensor(**sensor), clock, unit=unit, **keys)
        return
    made = imported(Sensor(**sensor), clock, unit=unit, **keys)
    assert made.origin.sign == expected
    assert made.rate_hz == pytest.approx(40.0, rel=0.01)
    response = respond(made)
    assert response.touched[made.cue > 0].mean() > 0.92
    assert (~response.touched)[made.cue == 0].mean() > 0.99


def test_a_sign_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(TOML + 'sign = "up"\n')
    with pytest.raises(RecordingError, match=r"sign.*falls.*rises"):
        read_description(file)
