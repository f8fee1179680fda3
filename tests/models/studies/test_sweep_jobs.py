"""Jobs have stable names, people are held out whole, and a sweep goes on where it was."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import models.studies.sweep
from models.studies.sweep import jobs, kept, local, people, perform, study, version
from models.studies.sweep.plan import Plan, parse
from models.studies.sweep.study import Sweep

VERSION = {"orbtouch": "1", "sources": "a"}


def planned(text: str = "[test]\nhold = 2\n[axes]\nusers = [1, 3]\nseed = [0, 1]") -> Plan:
    return parse(text, "people.toml", "people", lambda recipe, key, value: value)


def answer(order: str, right: int = 9) -> str:
    """What a job might come to: it hangs on the job alone."""
    asked = json.loads(order)
    users = asked["job"]["train"]["users"]
    events = [right + users, 20]
    return json.dumps(
        {
            "name": asked["name"],
            "result": {
                "learned": {"users": users, "sessions": users, "minutes": 3.0, "windows": 100},
                "epochs": 3, "best": 2, "check": 0.9, "random": 0.99,
                "held": [{"user": "4 05", "session": "4 01", "frames": [80, 90], "events": events}],
            },
            "where": "here 1", "seconds": 1.5, "cpu_s": 1.0,
        }
    )  # fmt: skip


def forwards(orders: Sequence[str]) -> Iterator[str]:
    yield from map(answer, orders)


def backwards(orders: Sequence[str]) -> Iterator[str]:
    yield from map(answer, reversed(orders))


def test_a_jobs_name_hangs_on_what_it_says_and_on_the_program_alone() -> None:
    one, *others = jobs.jobs(planned())
    name = jobs.name(one, VERSION)
    turned = {key: one[key] for key in reversed(one)}
    assert jobs.name(turned, dict(reversed(VERSION.items()))) == name
    assert jobs.name(one, {**VERSION, "sources": "b"}) != name
    assert len({name, *(jobs.name(other, VERSION) for other in others)}) == 4


def test_a_jobs_name_is_the_same_in_years_to_come() -> None:
    job = {
        "at": {"seed": 3}, "data": {"folders": ["here"], "sha256": "ff"},
        "train": {"seed": 3}, "test": {"by": "user", "hold": 1, "fold": 0},
    }  # fmt: skip
    text = (
        '[{"data":{"sha256":"ff"},"test":{"by":"user","fold":0,"hold":1},"train":{"seed":3}},'
        '{"orbtouch":"1","sources":"a"}]'
    )
    assert jobs.name(job, VERSION) == hashlib.sha256(text.encode()).hexdigest()[:24]


def test_recordings_are_known_by_what_is_in_them_not_by_where_they_lie() -> None:
    names = {
        jobs.name(job, VERSION)
        for place in ("here", "there")
        for job in jobs.jobs(planned(f"[data]\nfolders = ['{place}']\n[test]\nhold = 1"), "ff")
    }
    assert len(names) == 1


def test_every_user_is_held_out_in_one_fold() -> None:
    unit = np.array([3, 3, 5, 7, 7, 9, 11])
    folds = [people.held(unit, {"by": "user", "folds": 3, "fold": fold}) for fold in range(3)]
    assert (np.sum(folds, axis=0) == 1).all()
    for fold in folds:
        assert not set(unit[fold]) & set(unit[~fold])


def test_the_same_few_are_held_out_always_evenly_spread() -> None:
    unit = np.repeat(np.arange(10), 2)
    held = people.held(unit, {"by": "user", "hold": 2, "fold": 0})
    assert set(unit[held]) == {2, 7}
    with pytest.raises(ValueError, match="there are 10 users, too few for 10 held out"):
        people.held(unit, {"by": "user", "hold": 10, "fold": 0})


@given(st.integers(0, 2**32 - 1), st.integers(1, 8))
def test_fewer_people_are_among_the_more_and_nobody_held_out_is_learned_from(
    seed: int, users: int
) -> None:
    user = np.repeat(np.arange(10), 2)
    tested = np.isin(user, [2, 7])
    session = np.arange(20)

    def chosen(count: int) -> set[int]:
        asked = {"users": count, "sessions": 0, "seed": seed}
        mask = people.learned(user, session, tested, asked)
        assert not (mask & tested).any()
        return set(user[mask].tolist())

    assert len(chosen(users)) == users
    assert chosen(users) <= chosen(min(8, users + 1))


def test_of_each_person_the_first_sessions_are_learned_from() -> None:
    user, session = np.repeat(np.arange(3), 3), np.arange(9)
    tested = user == 2
    asked = {"users": 0, "sessions": 2, "seed": 0}
    assert people.learned(user, session, tested, asked).tolist() == [
        True, True, False, True, True, False, False, False, False,
    ]  # fmt: skip
    for key in ("users", "sessions"):
        with pytest.raises(ValueError, match=f"9 {key}"):
            people.learned(user, session, tested, {**asked, key: 9})


def test_results_are_the_same_bytes_in_whatever_order_they_come(tmp_path: Path) -> None:
    written = []
    for folder, engine in ((tmp_path / "a", forwards), (tmp_path / "b", backwards)):
        study.run(Sweep(planned(), folder), engine, lambda line: None)
        written.append((folder / kept.RESULTS).read_bytes())
    assert written[0] == written[1]
    assert b"seconds" not in written[0]


def test_an_interrupted_sweep_goes_on_with_what_is_missing(tmp_path: Path) -> None:
    asked: list[int] = []

    def stops(orders: Sequence[str]) -> Iterator[str]:
        asked.append(len(orders))
        for number, one in enumerate(map(answer, orders)):
            if len(asked) < 3 and number == 1:
                raise KeyboardInterrupt
            yield one

    sweep = Sweep(planned("[test]\nhold = 1\n[axes]\nseed = [0, 1, 2, 3]"), tmp_path / "x")
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            study.run(sweep, stops, lambda line: None)
    found = study.run(sweep, stops, lambda line: None)
    assert asked == [4, 3, 2]
    assert all("result" in job for job in found["jobs"])
    study.run(sweep, stops, lambda line: None)
    assert asked == [4, 3, 2]  # nothing was missing


def test_half_a_file_is_no_result_and_is_done_again(tmp_path: Path) -> None:
    sweep = Sweep(planned(), tmp_path)
    study.run(sweep, forwards, lambda line: None)
    one, two, *_ = sorted((tmp_path / kept.JOBS).iterdir())
    one.write_text(one.read_text()[:50])
    two.write_text("[]")
    seen: list[int] = []

    def counting(orders: Sequence[str]) -> Iterator[str]:
        seen.append(len(orders))
        yield from map(answer, orders)

    study.run(sweep, counting, lambda line: None)
    assert seen == [2]


def test_a_job_that_fails_is_told_and_the_others_go_on(tmp_path: Path) -> None:
    def one_fails(orders: Sequence[str]) -> Iterator[str]:
        for number, order in enumerate(orders):
            failed = {"name": json.loads(order)["name"], "failed": "no session is quiet"}
            yield json.dumps(failed) if number == 1 else answer(order)

    said: list[str] = []
    found = study.run(Sweep(planned(), tmp_path), one_fails, said.append)
    assert ["failed" in job for job in found["jobs"]] == [False, True, False, False]
    assert "2/4 users 1, seed 1: failed: no session is quiet" in said[2]
    found = study.run(Sweep(planned(), tmp_path), forwards, said.append)
    assert not any("failed" in job for job in found["jobs"])


def test_results_of_another_version_are_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep, said = Sweep(planned(), tmp_path), list[str]()
    study.run(sweep, forwards, said.append)
    monkeypatch.setattr(version, "own", lambda: VERSION)
    study.run(sweep, forwards, said.append)
    assert "of other settings or another version, and not used: 4 finished there" in said


def test_what_only_shows_results_is_no_part_of_the_version() -> None:
    names = {path for path, _ in version._files(files("models"), version.ASIDE["models"])}
    assert {"/training/loop.py", "/data/recipe.py", "/training/networks.py"} <= names
    assert not {"/cli/train.py", "/reports/page.py"} & names
    names = {path for path, _ in version._files(files("controller"), version.ASIDE["controller"])}
    assert {
        "/recognition/preprocess.py",
        "/bundles/gestures.toml",
        "/simulator/gestures/press.toml",
    } <= names


def test_the_program_tells_another_version_from_its_own() -> None:
    own = version.own()
    assert not version.differences(own, dict(own))
    other = {**own, "sources": "0", "torch": "1.0"}
    assert version.differences(own, other) == (
        f"sources 0 instead of {own['sources']}, torch 1.0 instead of {own['torch']}"
    )


def test_a_worker_of_another_version_says_so_and_trains_nothing() -> None:
    theirs = {**version.own(), "sources": "0"}
    order = json.dumps({"name": "n", "job": {}, "version": theirs})
    said = json.loads(perform.perform(order))
    assert "runs another version: sources" in said["failed"]
    assert said["name"] == "n"


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (ValueError("no session\nis quiet"), "no session is quiet"),
        (KeyError("x"), "KeyError in test_sweep_jobs.py, line"),
    ],
)
def test_what_goes_wrong_in_a_job_comes_back_as_a_sentence(
    error: Exception, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(job: Any) -> None:
        raise error

    monkeypatch.setattr(
        models.studies.sweep, "training", SimpleNamespace(train=broken), raising=False
    )
    order = json.dumps({"name": "n", "job": {}, "version": version.own()})
    found = json.loads(perform.perform(order))
    assert said in found["failed"]
    assert "\n" not in found["failed"]


def test_one_job_alone_needs_no_second_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local, "perform", answer)
    order = study.order(Sweep(planned(), Path()), "n", jobs.jobs(planned())[0])
    assert [json.loads(one)["name"] for one in local.run([order], 8, print)] == ["n"]


def test_a_folder_that_cannot_be_written_to_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ValueError, match=r"cannot write into .* choose another --out"):
        study.run(Sweep(planned(), tmp_path / "file"), forwards, lambda line: None)
