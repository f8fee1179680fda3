"""Processes that work beside each other have one thread each, unless somebody said otherwise."""

import os
from functools import partial

import pytest

from models import processes


def test_a_process_has_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """The names are those that OpenMP, OpenBLAS and MKL read."""
    for name in processes.THREADS:
        monkeypatch.setenv(name, "")  # so that it is undone
        monkeypatch.delenv(name)
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    jobs = {name: partial(os.getenv, name) for name in names}
    found = {key: value for key, value, _ in processes.completed(jobs, 2)}
    assert found == dict.fromkeys(names, "1")


def test_what_somebody_said_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in processes.THREADS:
        monkeypatch.setenv(name, "3")
    jobs = {number: partial(os.getenv, "OMP_NUM_THREADS") for number in range(2)}
    found = {key: value for key, value, _ in processes.completed(jobs, 2)}
    assert found == {0: "3", 1: "3"}
