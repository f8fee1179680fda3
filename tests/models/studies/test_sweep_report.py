"""Aggregation of many trainings: intervals over people, the table, and the curves."""

from typing import Any

import pytest

from models.studies.sweep import report

PEOPLE = 12


def result(right: list[int], users: int = 3, **more: Any) -> dict[str, Any]:
    """A training judged on people of twenty events each."""
    held = [
        {"user": str(who), "session": str(who), "frames": [90, 100], "events": [count, 20]}
        for who, count in enumerate(right)
    ]
    learned = {"users": users, "sessions": users, "minutes": 3.0, "windows": 900 * users}
    made = {
        "learned": learned, "notes": [], "epochs": 3, "random": 0.97,
        "held": held,
        "labels": ["null", "press", "<pinch>"], "confusion": [[0, 0, 0], [0, 18, 2], [0, 1, 19]],
    }  # fmt: skip
    return {**made, **more}


def found(axes: dict[str, list[Any]], jobs: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    said = {
        "sweep": "try & see", "version": "1", "axes": axes,
        "data": {"folders": ["<data>"]}, "train": {"task": "gesture"},
        "test": {"by": "user", "hold": PEOPLE}, "jobs": jobs,
    }  # fmt: skip
    return {**said, **more}


def job(at: dict[str, Any], right: list[int], **kw: Any) -> dict[str, Any]:
    return {"name": str(at), "at": at, "fold": 0, "result": result(right, at.get("users", 3), **kw)}


def test_seeds_repeat_a_training_and_do_not_make_more_people() -> None:
    jobs = [job({"users": 3, "seed": seed}, [18] * 6 + [12] * 6) for seed in range(5)]
    (many,) = report.points(found({"users": [3], "seed": [0, 1, 2, 3, 4]}, jobs))
    (one,) = report.points(found({"users": [3], "seed": [0]}, jobs[:1]))
    assert many.figure == one.figure
    assert many.figure.value == pytest.approx(0.75)
    assert many.trainings == 5


def test_folds_are_put_together_before_people_are_counted() -> None:
    first, second = job({}, [20] * 3), job({}, [10] * 3)
    for session in second["result"]["held"]:
        session["user"] += " of the other fold"
    (point,) = report.points(found({}, [first, second]))
    assert point.held == 6
    assert point.figure.value == pytest.approx(0.75)


def test_models_are_judged_on_the_people_whom_all_of_them_judged() -> None:
    """The second fold of the trees failed: its people do not count for the network either."""
    strong, weak = job({"model": "network"}, [20] * 3), job({"model": "network"}, [2] * 3)
    for session in weak["result"]["held"]:
        session["user"] += " of the other fold"
    rival = job({"model": "trees"}, [10] * 3)
    lost = {"name": "x", "at": {"model": "trees"}, "fold": 1, "failed": "no memory"}
    for session in rival["result"]["held"]:
        session["frames"] = [80, 100]
    network, trees = report.points(
        found({"model": ["network", "trees"]}, [strong, weak, rival, lost])
    )
    assert (network.held, trees.held) == (3, 3)
    assert (network.figure.value, trees.figure.value) == (1.0, 0.5)
    assert (trees.gain.value, trees.windows_gain.value) == pytest.approx((-0.5, -0.1))
    table = report.rows([network, trees])
    column = list(table.head).index("windows beside the first")
    assert [row[column][:4] for row in table.rows] == ["", "-0.1"]


def test_errors_are_reported_in_grid_units() -> None:
    jobs = [
        {"name": str(rate), "at": {"location.rate": rate}, "fold": 0, "result": {
            "learned": {"users": 3, "sessions": 3, "minutes": 3.0, "windows": 9},
            "notes": [], "epochs": 1, "random": None,
            "held": [{"user": str(who), "session": str(who), "error": [error, 10]}
                     for who in range(4)]}}
        for rate, error in ((0.1, 2.0), (0.2, 1.0))
    ]  # fmt: skip
    one = found({"location.rate": [0.1, 0.2]}, jobs, train={"task": "location"})
    assert "| 0.1 |" in report.table(one)
    assert "grid units" in report.table(one)


def test_what_failed_is_told_once_for_each_reason() -> None:
    bad = [{"name": str(i), "at": {"seed": i}, "fold": 0, "failed": "no <quiet>"} for i in range(5)]
    text = report.table(found({"seed": list(range(5))}, bad))
    assert text.startswith("try & see: 0 of 5 trainings; held out: by user, hold 12; scores: ")
    assert "failed (5): no <quiet> [seed 0, fold 1]" in text


def test_the_table_has_a_row_for_each_point() -> None:
    axes: dict[str, list[Any]] = {"users": [1, 3], "gesture.rate": [0.1, 0.2]}
    jobs = [
        job({"users": users, "gesture.rate": rate}, [8 + users + int(10 * rate)] * PEOPLE)
        for users in axes["users"]
        for rate in axes["gesture.rate"]
    ]
    table = report.rows(report.points(found(axes, jobs)))
    assert [row[:3] for row in table.rows][:2] == [["1", "0.1", "1"], ["1", "0.2", "1"]]
    assert [float(row[3]) for row in table.rows][:2] == [0.5, 0.55]
    assert float(table.rows[0][4]) <= 0.5 <= float(table.rows[0][5])
