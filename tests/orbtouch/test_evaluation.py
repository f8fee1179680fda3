"""Own predictors judged by the event metric, and compared with the networks that ship."""

import json
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import orbtouch

Windows = NDArray[np.float32]


@pytest.fixture(scope="module")
def sessions() -> list[orbtouch.Recording]:
    """Half a minute of each of three people."""
    return [orbtouch.simulate(minutes=0.5, user=user, rate_hz=10.0) for user in range(3)]


class Centroids:
    """Nearest mean last image; far from the others, it is sure."""

    def fit(self, some: Windows, y: NDArray[np.int64]) -> None:
        self.means = np.stack([some[y == k, -1].mean(axis=0) for k in np.unique(y)])

    def predict_proba(self, some: Windows) -> NDArray[np.float64]:
        apart = ((some[:, None, -1] - self.means) ** 2).sum(axis=(2, 3))
        near = np.exp(-100.0 * apart)
        return np.asarray(near / near.sum(axis=1, keepdims=True), np.float64)


def test_an_estimator_is_judged_on_people_whom_it_has_not_learned(
    sessions: list[orbtouch.Recording],
) -> None:
    learned = []

    class Spy(Centroids):
        def fit(self, some: Windows, y: NDArray[np.int64]) -> None:
            super().fit(some, y)
            learned.append(len(y))

    made = orbtouch.evaluate(Spy(), sessions)
    each = [len(one.windows().X) for one in sessions]
    assert learned[1::2] == [sum(each) - own for own in each]
    # And before, on one of these two, for the thresholds that are chosen on the other
    assert all(one in each for one in learned[::2])
    assert (made.sessions, made.classes) == (3, sessions[0].classes)
    assert made.events == made.confusion[1:].sum() > 0
    assert 0.0 < float(made.recall) < 1.0


def test_recordings_of_one_session_cannot_be_split(sessions: list[orbtouch.Recording]) -> None:
    halves = [sessions[0][:15.0], sessions[0][15.0:]]
    with pytest.raises(orbtouch.Error, match="all recordings are of one session, so none can"):
        orbtouch.evaluate(Centroids(), halves)
    with pytest.raises(orbtouch.Error, match="all recordings are of one user"):
        orbtouch.evaluate(Centroids(), halves, by="user")


def certain(number: int, columns: int = 5) -> Any:
    def answer(some: Windows) -> NDArray[np.float64]:
        return np.asarray(np.eye(columns)[np.full(len(some), number)], np.float64)

    return answer


def test_a_callable_that_always_answers_null_misses_everything(
    sessions: list[orbtouch.Recording],
) -> None:
    made = orbtouch.evaluate(certain(0), sessions)
    assert (float(made.recall), made.confusion[1:, 0].sum()) == (0.0, made.events)
    assert float(made.false_alarms_per_min) == 0.0


def test_a_recording_does_not_count_twice(sessions: list[orbtouch.Recording]) -> None:
    with pytest.raises(orbtouch.Error, match="is given twice"):
        orbtouch.evaluate(certain(0), [*sessions, sessions[0]])
    assert orbtouch.evaluate(certain(0), [sessions[0][:10.0], sessions[0][10.0:]]).sessions == 2


def test_a_networks_debouncer_judges_a_callable_of_other_classes() -> None:
    taps = orbtouch.simulate(minutes=0.3, gestures=("press",), rate_hz=10.0)
    shipped = orbtouch.load_network("models/orbtouch-10hz.orb")
    made = orbtouch.evaluate(
        certain(1, columns=2), taps, classes=("null", "press"), debounce=shipped
    )
    assert made.classes == ("null", "press")


def broken(some: Windows) -> NDArray[np.float64]:
    raise KeyError("no such layer")


@pytest.mark.parametrize(
    ("predict", "problem"),
    [
        (lambda some: np.full((len(some), 5), 0.3), r"returned \[0\.3.*which sum to 1"),
        (lambda some: np.full((len(some), 5), np.nan), "which sum to 1"),
        (lambda some: np.eye(5)[0], r"returned \(5,\), not"),
        (certain(0, columns=4), "expected are probabilities of null, press, pinch"),
        (broken, "broken raised KeyError at windows"),
    ],
)
def test_what_returns_no_probabilities_is_refused(
    sessions: list[orbtouch.Recording], predict: Any, problem: str
) -> None:
    with pytest.raises(orbtouch.Error, match=problem):
        orbtouch.evaluate(predict, sessions[0])


def test_two_predictors_are_compared_by_recording(sessions: list[orbtouch.Recording]) -> None:
    shipped = orbtouch.evaluate(orbtouch.load_network("models/orbtouch-10hz.orb"), sessions)
    nothing = orbtouch.evaluate(certain(0), sessions)
    made = orbtouch.compare(shipped, nothing)
    assert float(made.recall) == float(shipped.recall)
    assert made.recall.low > 0.0
    assert float(orbtouch.compare(shipped, shipped).f1) == 0.0
    with pytest.raises(orbtouch.Error, match="of different recordings"):
        orbtouch.compare(shipped, orbtouch.evaluate(certain(0), sessions[:2]))


def test_figures_become_numbers_tables_and_json(sessions: list[orbtouch.Recording]) -> None:
    made = orbtouch.evaluate(certain(0), sessions)
    assert made.to_dict()["recall"]["value"] == 0.0
    assert json.loads(made.to_json())["latency"]["value"] is None  # nothing was answered
    assert "95 % by resampling recordings" in str(made)
    pandas = pytest.importorskip("pandas")
    assert isinstance(made.to_pandas(), pandas.DataFrame)
    assert made.to_pandas().loc["recall", "value"] == 0.0
