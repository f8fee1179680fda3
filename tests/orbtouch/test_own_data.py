"""Own arrays, tables and files as recordings, and windows of these for an own network."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import orbtouch

RNG = np.random.default_rng(1)


def pushed(sign: float = 1.0, user: str = "ada", session: str = "1") -> orbtouch.Recording:
    """Return ten seconds of 4×6 taxels at 20 Hz that count up by 200 in five touches."""
    frames = RNG.normal(0.0, 1.0, (200, 4, 6))
    labels = np.full(200, "null", dtype="U8")
    for begin in range(60, 200, 30):
        frames[begin : begin + 12, 1:3, 2:4] += sign * 200.0
        labels[begin : begin + 12] = "push"
    return orbtouch.Recording.from_arrays(
        frames, rate_hz=20, labels=labels, unit="counts", pitch_mm=4, user=user, session=session
    )


def test_arrays_become_a_recording() -> None:
    frames = np.ones((3, 2, 2)) * [[[1]], [[2]], [[3]]]
    made = orbtouch.Recording.from_arrays(
        frames, t=[5.0, 5.1, 5.2], labels=["null", "wave", ""], unit="counts", user="ada"
    )
    assert made.frames[:, 0, 0].tolist() == [1, 2, 3]
    assert made.t == pytest.approx([0.0, 0.1, 0.2])
    assert made.labels.tolist() == ["null", "wave", ""]
    assert (made.classes, made.user, made.unit) == (("null", "wave"), "ada", "counts")
    assert made.rate_hz == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        ({"frames": np.ones((4, 25))}, r"frames: float64 \(4, 25\); expected are numbers"),
        ({"frames": [[[1.0]], [[1.0, 2.0]]]}, "frames are no array"),
        ({"frames": np.full((4, 1, 1), np.nan)}, "frame 0 has a reading that is no number"),
        ({"frames": np.full((4, 1, 1), 1e300)}, r"no number \(NaN, or above 3e38\)"),
        ({"frames": np.ma.masked_less(np.ones((4, 1, 1)), 2)}, "frames are masked in places"),
        ({"frames": np.empty((0, 5, 5))}, r"frames: float64 \(0, 5, 5\); expected are numbers"),
        ({"rate_hz": None}, "the rate is unknown; give t"),
        ({"t": [0, 25, 50, 75]}, "t has 0.04 frames a second, of 1 to 10000; it is in seconds"),
        ({"t": [0.0, 0.1, 0.2, 0.3]}, "t has 10 frames a second, rate_hz is 20; give one"),
        ({"frames": np.ones((1, 2, 2)), "t": [0.0], "rate_hz": None}, "the rate is unknown"),
        ({"labels": np.array([1, 2, 1, None], object)}, "labels: object"),
        ({"rate_hz": "40"}, "rate_hz = '40'; expected is a number from 1 to 10000"),
        ({"t": [0.0, 0.2, 0.1, 0.3]}, r"t does not rise from frame 1 to 2 \(0.2 s, 0.1 s\)"),
        ({"t": [0.0, 0.1]}, r"t: float64 \(2,\); expected are numbers, one for each of 4 frames"),
        (
            {"labels": ["null"] * 5},
            r"labels: <U4 \(5,\); expected are names, one for each of 4 frames",
        ),
        ({"labels": [0, 1, 1, 0]}, r"labels: int64 \(4,\); expected are names"),
        ({"pitch_mm": 0}, "pitch_mm = 0; expected is a number from 0.001"),
        ({"sign": 1}, "sign = 1; expected is one of 'falls', 'rises', ''"),
        ({"user": 3}, "the recording has user = 3; expected is a text"),
        ({"user": "a b"}, "the user 'a b' names files, so it must be 1 to"),
        ({"session": "a/b"}, "the session 'a/b' names files"),
        ({"frames": np.zeros((4, 2, 2))}, "100% are 0 or below, and pF are divided by"),
    ],
)
def test_unfit_arrays_are_refused_in_a_sentence(given: dict[str, Any], problem: str) -> None:
    usual: dict[str, Any] = {"frames": np.ones((4, 2, 2)), "rate_hz": 20.0}
    with pytest.raises(orbtouch.Error, match=problem):
        orbtouch.Recording.from_arrays(**(usual | given))


def test_arrays_of_other_kinds_are_what_they_hold() -> None:
    frames = np.arange(12, dtype=np.uint8).reshape(3, 2, 2)
    lists, each = frames.tolist(), (one for one in frames.astype(np.float16))
    labels = np.array(["null", "push", None], dtype=object)  # as a column of a table has them
    for given in (frames, lists, each):
        made = orbtouch.Recording.from_arrays(given, rate_hz=20, labels=labels)
        assert made.frames.tolist() == lists
        assert made.labels.tolist() == ["null", "push", ""]


def test_a_recording_goes_through_pandas_and_csv_unchanged(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    made = pushed()
    again = orbtouch.Recording.from_pandas(made.to_pandas(), unit="counts")
    assert np.array_equal(again.frames, made.frames)
    assert (again.labels == made.labels).all()
    made.to_pandas().to_csv(tmp_path / "own.csv")
    (third,) = orbtouch.import_recordings(
        tmp_path / "own.csv",
        frames="r[0-9]*",
        rows=4,
        columns=6,
        pitch_mm=4.0,
        unit="counts",
        time="t",
        label="label",
        label_names="label_names",
        null="null",
    )
    assert third.frames == pytest.approx(made.frames)
    assert (third.labels == made.labels).all()
    with pytest.raises(orbtouch.Error, match="has 23 columns of taxels, of 4 x 6"):
        orbtouch.Recording.from_pandas(made.to_pandas().drop(columns="r1c1"))


def test_windows_are_those_of_the_device_with_what_was_found() -> None:
    made = pushed().windows()
    assert made.X.shape[1:] == (20, 4, 6)
    assert (made.sign, made.classes) == (1, ("null", "push"))
    assert made.rest == pytest.approx(np.zeros((4, 6)), abs=1.5)
    assert made.scale is not None
    assert made.X[:, -1, 1, 2][made.y == 1].mean() == pytest.approx(1 + 200 / made.scale, rel=0.1)
    assert set(made.groups) == {"ada"}
    assert made.t[0] >= 1.0
    assert pushed(-1.0).windows().sign == -1


@pytest.mark.parametrize("preset", ["nominal", "paper-snr"])
@pytest.mark.parametrize("gesture", ["press", "pinch", "twist_cw"])
def test_it_is_found_out_that_a_touch_lowers_an_orbs_readings(preset: str, gesture: str) -> None:
    orb = orbtouch.simulate(minutes=0.5, preset=preset, gestures=(gesture,), seed=2)
    bare = orbtouch.Recording.from_arrays(orb.frames, rate_hz=40)
    assert orbtouch.load_network().run(bare)


def test_windows_of_an_orb_are_what_its_network_sees() -> None:
    session = orbtouch.simulate(minutes=0.3, seed=3)
    made, network = session.windows(), orbtouch.load_network()
    assert made.X.shape[1:] == (round(network.rate_hz), *network.shape)
    assert made.scale is None
    names = np.array(made.classes)[made.y]
    assert (names == session.labels[session.t.searchsorted(made.t)]).all()
    some = session[8.0:12.0].windows(every=4)
    assert (some.t[0] >= 8.0, some.t[-1] < 12.0, len(some.X)) == (True, True, 40)
    assert np.array_equal(some.X[0], made.X[made.t.searchsorted(some.t[0])])


def test_a_window_without_labels_or_of_no_length_is_refused() -> None:
    bare = orbtouch.Recording.from_arrays(np.ones((90, 2, 2)), rate_hz=20)
    with pytest.raises(orbtouch.Error, match="no labels; label it first"):
        bare.windows()
    with pytest.raises(orbtouch.Error, match=r"window = 0\.5; expected is a number from 2 to 250"):
        pushed().windows(0.5)  # type: ignore[arg-type]
