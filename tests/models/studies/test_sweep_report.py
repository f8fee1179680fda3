"""Aggregation of many trainings: intervals over people, the best of many, and the page."""

from html.parser import HTMLParser
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from models.studies.sweep import figures, report, told
from models.studies.sweep.choice import choose
from models.studies.sweep.figures import MEASURES

PEOPLE = 12


def result(right: list[int], users: int = 3, **more: Any) -> dict[str, Any]:
    """A training judged on people of twenty events each."""
    held = [
        {"user": str(who), "session": str(who), "frames": [90, 100], "events": [count, 20]}
        for who, count in enumerate(right)
    ]
    learned = {"users": users, "sessions": users, "minutes": 3.0, "windows": 900 * users}
    made = {
        "learned": learned, "epochs": 3, "best": 2, "check": 0.9, "random": 0.97, "held": held,
        "labels": ["null", "press", "<pinch>"], "confusion": [[0, 0, 0], [0, 18, 2], [0, 1, 19]],
    }  # fmt: skip
    return {**made, **more}


def found(axes: dict[str, list[Any]], jobs: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    said = {
        "sweep": "try & see", "version": {"orbtouch": "1"}, "axes": axes,
        "data": {"folders": ["<data>"]}, "train": {"task": "gesture"},
        "test": {"by": "user", "hold": PEOPLE}, "jobs": jobs,
    }  # fmt: skip
    return {**said, **more}


def job(at: dict[str, Any], right: list[int], **more: Any) -> dict[str, Any]:
    return {
        "name": str(at),
        "at": at,
        "fold": 0,
        "result": result(right, at.get("users", 3), **more),
    }


def grid(rng: np.random.Generator, skill: list[float]) -> dict[str, Any]:
    """As many settings as skills, judged on the same people, who differ as well."""
    person = rng.normal(0.0, 0.05, PEOPLE)
    jobs = [
        job({"gesture.rate": float(i)},
            rng.binomial(20, np.clip(one + person, 0.0, 1.0)).tolist())
        for i, one in enumerate(skill)
    ]  # fmt: skip
    return found({"gesture.rate": [float(i) for i in range(len(skill))]}, jobs)


def test_seeds_repeat_a_training_and_do_not_make_more_people() -> None:
    jobs = [job({"users": 3, "seed": seed}, [18] * 6 + [12] * 6) for seed in range(5)]
    (many,) = figures.points(found({"users": [3], "seed": [0, 1, 2, 3, 4]}, jobs))
    (one,) = figures.points(found({"users": [3], "seed": [0]}, jobs[:1]))
    assert many.figure == one.figure
    assert many.figure.value == pytest.approx(0.75)
    assert many.trainings == len(many.by_seed) == 5


def test_folds_are_put_together_before_people_are_counted() -> None:
    first, second = job({}, [20] * 3), job({}, [10] * 3)
    for session in second["result"]["held"]:
        session["user"] += " of the other fold"
    (point,) = figures.points(found({}, [first, second]))
    assert len(point.counts) == 6
    assert point.figure.value == pytest.approx(0.75)


def test_an_axis_alone_takes_all_others_together() -> None:
    axes: dict[str, list[Any]] = {"users": [1, 2], "gesture.rate": [0.1, 0.2]}
    jobs = [
        job({"users": users, "gesture.rate": rate}, [right] * PEOPLE)
        for users, rate, right in ((1, 0.1, 10), (1, 0.2, 12), (2, 0.1, 16), (2, 0.2, 20))
    ]
    along = figures.along(found(axes, jobs), "users")
    assert [point.figure.value for point in along] == pytest.approx([0.55, 0.9])


def test_all_is_as_far_along_an_axis_as_what_was_learned() -> None:
    everybody = {"name": "x", "at": {"users": 0}, "fold": 0, "result": result([20], users=8)}
    (point,) = figures.points(found({"users": [0]}, [everybody]))
    assert figures.amount(point, "users") == 8.0


def test_the_best_of_equals_is_luck_and_the_luck_is_told() -> None:
    """Twenty settings that are equally good: what the winner shows too much is known exactly."""
    shown, luck = [], []
    for seed in range(30):
        points = figures.points(grid(np.random.default_rng(seed), [0.8] * 20))
        chosen = choose(points, MEASURES["gesture"])
        assert chosen is not None
        shown.append(chosen.best.figure.value - np.mean([p.figure.value for p in points]))
        luck.append(chosen.luck)
    assert 0.02 < np.mean(shown) < 0.08
    assert np.mean(luck) == pytest.approx(np.mean(shown), rel=0.6)


def test_what_is_truly_better_is_told_apart() -> None:
    points = figures.points(grid(np.random.default_rng(0), [0.6, 0.9, 0.7]))
    chosen = choose(points, MEASURES["gesture"])
    assert chosen is not None
    assert chosen.best.at == {"gesture.rate": 1.0}
    assert chosen.better.low > 0.0
    assert chosen.kept == 1.0
    assert not any("do not tell" in line for line in told.best(chosen, MEASURES["gesture"], 3))


def test_less_error_is_better() -> None:
    jobs = [
        {"name": str(rate), "at": {"location.rate": rate}, "fold": 0, "result": {
            "learned": {"users": 3, "sessions": 3, "minutes": 3.0, "windows": 9},
            "epochs": 1, "best": 1, "check": None, "random": None,
            "held": [{"user": str(who), "session": str(who), "error": [error, 10]}
                     for who in range(4)]}}
        for rate, error in ((0.1, 2.0), (0.2, 1.0))
    ]  # fmt: skip
    one = found({"location.rate": [0.1, 0.2]}, jobs, train={"task": "location"})
    chosen = choose(figures.points(one), MEASURES["location"])
    assert chosen is not None
    assert chosen.best.at == {"location.rate": 0.2}
    assert "0.100" in told.table(one)
    assert "grid units" in report.html(one, {})


def test_nothing_is_chosen_between_amounts_or_between_different_people() -> None:
    for axis, values in (("users", [1, 2]), ("data.seed", [1, 2])):
        one = found({axis: values}, [job({axis: value}, [15] * 5) for value in values])
        assert choose(figures.points(one), MEASURES["gesture"]) is None


def test_the_table_has_a_row_for_each_point_and_a_word_on_luck() -> None:
    text = told.table(grid(np.random.default_rng(1), [0.8, 0.8, 0.8]))
    assert text.startswith("try & see: 3 of 3 trainings; 12 users held out, always the same")
    assert "some of them is luck" in text
    assert "models evaluate" in text
    rows = [line for line in text.splitlines() if line[:2] in ("0 ", "1 ", "2 ")]
    assert len(rows) == 3


def test_what_failed_is_told_once_for_each_reason() -> None:
    jobs = [
        {"name": str(i), "at": {"seed": i}, "fold": 0, "failed": "no <quiet>"} for i in range(5)
    ]
    text = told.table(found({"seed": list(range(5))}, jobs))
    assert "failed (5): no <quiet> [seed 0, fold 1; seed 1, fold 1; seed 2, fold 1; ...]" in text
    page = report.html(found({"seed": list(range(5))}, jobs), {})
    assert "no &lt;quiet&gt;" in page


class Reader(HTMLParser):
    """Checks that what is opened is closed, and that nothing is fetched from elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.linked: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.linked += [value or "" for name, value in attrs if name in ("src", "href")]
        if tag not in ("meta", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.linked += [value or "" for name, value in attrs if name in ("src", "href")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_is_whole_needs_nothing_else_and_draws_each_curve() -> None:
    axes: dict[str, list[Any]] = {"users": [1, 3, 10], "gesture.rate": [0.1, 0.2]}
    jobs = [
        job({"users": users, "gesture.rate": rate}, [min(20, 8 + users + int(10 * rate))] * PEOPLE)
        for users in axes["users"] for rate in axes["gesture.rate"]
    ]  # fmt: skip
    times = {one["name"]: {"where": "here & there 1", "seconds": 3.0, "cpu_s": 2.5} for one in jobs}
    page = report.html(found(axes, jobs), times)
    reader = Reader()
    reader.feed(page)
    assert not reader.open
    assert not reader.linked
    assert page.count("<svg") == 2  # users, and rate
    assert "&lt;data&gt;" in page
    assert "<pinch>" not in page
    assert "here &amp; there 1" in page


def test_a_curve_over_tenfold_amounts_has_equal_factors_equally_long() -> None:
    jobs = [job({"users": users}, [15] * PEOPLE) for users in (1, 10, 100)]
    page = report.html(found({"users": [1, 10, 100]}, jobs), {})
    at = [float(part.split('"')[0]) for part in page.split('<circle class="mark l0" cx="')[1:]]
    near, far = (b - a for a, b in pairwise(at))
    assert near == pytest.approx(far, abs=0.2)


def test_of_too_many_lines_one_is_drawn() -> None:
    axes: dict[str, list[Any]] = {"users": [1, 2], "gesture.batch": list(range(1, 9))}
    jobs = [
        job({"users": users, "gesture.batch": batch}, [15] * PEOPLE)
        for users in (1, 2) for batch in axes["gesture.batch"]
    ]  # fmt: skip
    assert "all else together" in report.html(found(axes, jobs), {})
