"""Jobs have stable names, people are held out whole, and a sweep goes on where it was."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import models.studies.sweep
from controller.shared import config
from controller.shared.errors import UserError
from models.data import splits
from models.data.splits import HoldOut
from models.studies.sweep import run
from models.studies.sweep.plan import Job, Plan, parse
from models.studies.sweep.run import Answer, Sweep
from tests.support.pytest_types import Patch

VERSION = "1.0 (sources a)"
Engine = Callable[[Sweep, Sequence[Job]], Iterator[Answer]]
SetEngine = Callable[[Engine], None]


def planned(text: str = "[test]\nhold = 2\n[axes]\nusers = [1, 3]\nseed = [0, 1]") -> Plan:
    return parse(config.parse_toml(text), "people")


def answer(order: Job, right: int = 9) -> Answer:
    """What a job might come to: it hangs on the job alone."""
    users = order["job"]["train"].get("users", 3)
    events = [right + users, 20]
    held = [{"user": "4 05", "session": "4 01", "frames": [80, 90], "events": events}]
    learned = {"users": users, "sessions": users, "minutes": 3.0, "windows": 100}
    result = {"learned": learned, "notes": [], "random": 0.99, "held": held}
    return {"name": order["name"], "result": result, "where": "here 1", "cpu_s": 1.0}


def forwards(sweep: Sweep, orders: Sequence[Job]) -> Iterator[Answer]:
    yield from map(answer, orders)


def backwards(sweep: Sweep, orders: Sequence[Job]) -> Iterator[Answer]:
    yield from map(answer, reversed(orders))


def silent(line: str) -> None:
    """Ignore progress."""


@pytest.fixture
def engine(monkeypatch: Patch) -> SetEngine:
    """Sets what does the jobs."""
    return lambda one: monkeypatch.setattr(run, "_answers", lambda at, orders: one(at, orders))


def test_a_jobs_name_is_the_same_in_years_to_come() -> None:
    job = {
        "at": {"seed": 3}, "data": {"folders": ["here"], "sha256": "ff"},
        "train": {"seed": 3}, "test": {"by": "user", "hold": 1, "fold": 0},
    }  # fmt: skip
    text = (
        '{"data":{"sha256":"ff"},"test":{"by":"user","fold":0,"hold":1},"train":{"seed":3},'
        '"version":"1.0 (sources a)"}'
    )
    assert run.name_of(job, VERSION) == hashlib.sha256(text.encode()).hexdigest()[:24]


def test_every_user_is_held_out_in_one_fold() -> None:
    unit = np.array([3, 3, 5, 7, 7, 9, 11])
    folds = [HoldOut("user", folds=3).held(unit, unit, fold) for fold in range(3)]
    assert (np.sum(folds, axis=0) == 1).all()
    for fold in folds:
        assert not set(unit[fold]) & set(unit[~fold])


def test_the_same_few_are_held_out_always_evenly_spread() -> None:
    unit = np.repeat(np.arange(10), 2)
    held = HoldOut("user", hold=2).held(unit, unit)
    assert set(unit[held]) == {2, 7}
    with pytest.raises(ValueError, match="there are 10 users, too few for 10 held out"):
        HoldOut("user", hold=10).held(unit, unit)


@given(st.integers(0, 2**32 - 1), st.integers(1, 8))
def test_fewer_people_are_among_more_and_none_held_out_is_learned(seed: int, users: int) -> None:
    user = np.repeat(np.arange(10), 2)
    tested = np.isin(user, [2, 7])
    session = np.arange(20)

    def chosen(count: int) -> set[int]:
        mask = splits.learned(user, session, tested, count, 0, seed)
        assert not (mask & tested).any()
        return set(user[mask].tolist())

    assert len(chosen(users)) == users
    assert chosen(users) <= chosen(min(8, users + 1))


def test_of_each_person_the_first_sessions_are_learned_from() -> None:
    user, session = np.repeat(np.arange(3), 3), np.arange(9)
    tested = user == 2
    assert splits.learned(user, session, tested, 0, 2, 0).tolist() == [
        True, True, False, True, True, False, False, False, False,
    ]  # fmt: skip
    for amounts, wanted in (((9, 0), "9 users"), ((0, 9), "9 sessions")):
        with pytest.raises(ValueError, match=wanted):
            splits.learned(user, session, tested, *amounts, 0)


def test_results_are_the_same_bytes_in_any_order(tmp_path: Path, engine: SetEngine) -> None:
    written = []
    for folder, order in ((tmp_path / "a", forwards), (tmp_path / "b", backwards)):
        engine(order)
        run.run(Sweep(planned(), folder), silent)
        written.append((folder / run.RESULTS).read_bytes())
    assert written[0] == written[1]
    assert b"cpu_s" not in written[0]


def test_an_interrupted_sweep_goes_on_with_the_rest(tmp_path: Path, engine: SetEngine) -> None:
    asked: list[int] = []

    def stops(sweep: Sweep, orders: Sequence[Job]) -> Iterator[Answer]:
        asked.append(len(orders))
        for number, one in enumerate(map(answer, orders)):
            if len(asked) < 3 and number == 1:
                raise KeyboardInterrupt
            yield one

    engine(stops)
    sweep = Sweep(planned("[test]\nhold = 1\n[axes]\nseed = [0, 1, 2, 3]"), tmp_path / "x")
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            run.run(sweep, silent)
    found = run.run(sweep, silent)
    assert asked == [4, 3, 2]
    assert all("result" in job for job in found["jobs"])
    run.run(sweep, silent)
    assert asked == [4, 3, 2, 0]  # nothing was missing


def test_a_failed_job_is_told_and_the_others_go_on(tmp_path: Path, engine: SetEngine) -> None:
    def one_fails(sweep: Sweep, orders: Sequence[Job]) -> Iterator[Answer]:
        for number, order in enumerate(orders):
            failed = {"name": order["name"], "failed": "no session is quiet"}
            yield failed if number == 1 else answer(order)

    said: list[str] = []
    engine(one_fails)
    found = run.run(Sweep(planned(), tmp_path), said.append)
    assert ["failed" in job for job in found["jobs"]] == [False, True, False, False]
    assert "2/4 users 1, seed 1: failed: no session is quiet" in said[2]
    engine(forwards)
    found = run.run(Sweep(planned(), tmp_path), said.append)
    assert not any("failed" in job for job in found["jobs"])


def test_a_worker_of_another_version_says_so_and_trains_nothing() -> None:
    said = run.perform({"name": "n", "job": {}, "version": VERSION})
    assert f"has {run.own_version()}, not {VERSION}" in said["failed"]
    assert said["name"] == "n"


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (ValueError("no session\nis quiet"), "no session is quiet"),
        (KeyError("x"), "KeyError in test_sweep_jobs.py, line"),
    ],
)
def test_a_job_s_error_is_one_sentence(error: Exception, said: str, monkeypatch: Patch) -> None:
    def bad(job: Any) -> None:
        raise error

    monkeypatch.setattr(models.studies.sweep, "training", SimpleNamespace(train=bad), raising=False)
    found = run.perform({"name": "n", "job": {}, "version": run.own_version()})
    assert said in found["failed"]
    assert "\n" not in found["failed"]


def test_a_folder_that_cannot_be_written_to_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"cannot write into .* choose another folder"):
        run.run(Sweep(planned(), tmp_path / "file"), silent)


class Cluster:
    """Stands for a Dask client, whose workers are there or not."""

    def __init__(self, *, staffed: bool) -> None:
        self.staffed, self.waited_s = staffed, 0.0

    def wait_for_workers(self, n_workers: int, timeout: float) -> None:
        self.waited_s = timeout
        if not self.staffed:
            raise TimeoutError

    def close(self) -> None:
        """Close nothing."""


def test_a_worker_has_half_a_minute_to_register(monkeypatch: Patch) -> None:
    distributed = pytest.importorskip("distributed", reason="needs the [sweep] extra")
    for cluster in (Cluster(staffed=True), Cluster(staffed=False)):
        monkeypatch.setattr(distributed, "Client", lambda *_, it=cluster, **__: it)
        if cluster.staffed:
            assert run._connected("127.0.0.1:1") is cluster
        else:
            with pytest.raises(run.ClusterError, match="no workers after 30 s"):
                run._connected("127.0.0.1:1")
        assert cluster.waited_s == 30.0
