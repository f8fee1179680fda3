"""A sweep is trained for real: on this process, on others, and on a cluster that loses a worker."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.support import ROOT
from tests.support.pytest_types import Capture

pytest.importorskip("torch", reason="needs the [train] extra")

from controller.recordings import writer
from models.__main__ import main
from models.data.simulate import DataSet
from models.studies.sweep import plan, run

pytestmark = pytest.mark.train

PATIENCE_S = 240.0  # for what a busy machine takes long to do
TINY = """
[data]
folders = ["people"]

[train]
gesture.epochs = 1

[test]
hold = 1

[axes]
users = [1, 2, 3]
seed = [0, 1, 2]
"""


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny sweep, trained one after the other in this process."""
    folder = tmp_path_factory.mktemp("alone")
    people = ["--out", str(folder / "people"), "--users", "4", "--sessions", "1"]
    assert main(["simulate", *people, "--minutes", "1", "--rate", "10", "--workers", "1"]) == 0
    (folder / "tiny.toml").write_text(TINY)
    assert main(["sweep", str(folder / "tiny.toml"), "--workers", "1"]) == 0
    return folder / "tiny.sweep"


def results(folder: Path) -> bytes:
    return (folder / run.RESULTS).read_bytes()


def done(folder: Path) -> int:
    return len(list((folder / run.JOBS).glob("[!.]*.json")))


def test_a_sweep_learns_from_as_many_as_told_and_judges_one_it_never_saw(alone: Path) -> None:
    found = json.loads(results(alone))
    assert [job["at"] for job in found["jobs"]] == [
        {"users": users, "seed": seed} for users in (1, 2, 3) for seed in (0, 1, 2)
    ]
    for job in found["jobs"]:
        assert job["result"]["learned"]["users"] == job["at"]["users"]
        (held,) = job["result"]["held"]
        assert held["user"].endswith(" 03")
        assert held["frames"][1] > 400
        assert 0 < held["frames"][0] <= held["frames"][1]


def test_a_process_that_dies_ends_the_sweep_until_later(alone: Path, tmp_path: Path) -> None:
    out = tmp_path / "x"
    sweep = [sys.executable, "-m", "models", "sweep", str(alone.parent / "tiny.toml"), "--workers"]
    with subprocess.Popen([*sweep, "2", "--out", str(out)], cwd=ROOT, stderr=subprocess.PIPE,
                          text=True) as swept:  # fmt: skip
        until(lambda: done(out) >= 1, swept)
        answer = json.loads(next((out / run.JOBS).glob("[!.]*.json")).read_text())
        os.kill(int(answer["where"].split()[-1]), signal.SIGKILL)
        assert swept.stderr is not None
        assert "a process died" in swept.stderr.read()
        assert swept.wait(PATIENCE_S) != 0
    subprocess.run([*sweep, "1", "--out", str(out)], cwd=ROOT, capture_output=True, check=True)
    assert results(out) == results(alone)


@contextlib.contextmanager
def running(*command: str) -> Iterator[subprocess.Popen[bytes]]:
    """A program that is ended, whatever happens."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    with subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL) as process:  # fmt: skip
        try:
            yield process
        finally:
            process.kill()


def until(
    there: Callable[[], bool], process: "subprocess.Popen[str] | subprocess.Popen[bytes]"
) -> None:
    """Wait for something that a process does."""
    end = time.monotonic() + PATIENCE_S
    while not there():
        assert process.poll() is None, "it ended before its time"
        assert time.monotonic() < end, "it did not happen"
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(0.05)


def test_a_cluster_that_loses_a_worker_gives_the_same_bytes(alone: Path, tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="needs the [sweep] extra")
    file, out = tmp_path / "scheduler.json", tmp_path / "x"
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1"]
    own = ["--port", "0", "--dashboard-address", "127.0.0.1:0", "--scheduler-file", str(file)]
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(file),
              "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny", "--no-dashboard",
              "--local-directory", str(tmp_path)]  # fmt: skip
    toml = str(alone.parent / "tiny.toml")
    with running(*dask, *own) as scheduler:
        until(lambda: file.exists() and file.stat().st_size > 0, scheduler)
        address = json.loads(file.read_text())["address"]
        sweep = [sys.executable, "-m", "models", "sweep", toml, "--out", str(out)]
        with running(*worker) as lost, running(*worker):
            with running(*sweep, "--cluster", address) as swept:
                until(lambda: done(out) >= 2, swept)
                lost.kill()
                assert done(out) < 9
                assert swept.wait(PATIENCE_S) == 0
            assert results(out) == results(alone)
            again = subprocess.run(
                [*sweep, "--cluster", "127.0.0.1:1"], cwd=ROOT, capture_output=True, text=True,
                timeout=PATIENCE_S, check=True,
            )  # fmt: skip
    assert "9 trainings, 9 of them done already" in again.stderr  # and nobody was asked


def test_both_models_of_places_are_judged_on_the_same(tmp_path: Path, capsys: Capture) -> None:
    made = DataSet(minutes=1.0)
    (tmp_path / "data").mkdir()
    for user in range(3):
        name = f"sub-0{user + 1}_ses-01_run-01.npz"
        (tmp_path / "data" / name).write_bytes(writer.pack(made.session(user, 0)))
    toml = tmp_path / "own.toml"
    toml.write_text(
        "[data]\nfolders = ['data']\n[train]\ngesture.epochs = 1\nlocation.epochs = 1\n"
        "task = 'location'\n[test]\nfolds = 3\n[axes]\nmodel = ['network', 'trees']"
    )
    assert main(["sweep", str(toml), "--workers", "1"]) == 0
    found = json.loads(results(tmp_path / "own.sweep"))
    held = [job["result"]["held"][0] for job in found["jobs"]]
    assert [one["user"].split()[-1] for one in held] == ["01", "02", "03"] * 2
    touches = [one["error"][1] for one in held]
    assert touches[:3] == touches[3:]  # both models are judged on the same
    assert "grid units" in capsys.readouterr().out
    assert str(tmp_path) not in json.dumps(found)
    toml.write_text("[data]\nfolders = ['elsewhere']")
    assert main(["sweep", str(toml)]) == 2
    assert "there is no folder elsewhere" in capsys.readouterr().err


def test_no_scheduler_is_told(alone: Path, tmp_path: Path, free_port: int, capsys: Capture) -> None:
    pytest.importorskip("distributed", reason="needs the [sweep] extra")
    toml = str(alone.parent / "tiny.toml")
    for address, why in (
        (f"127.0.0.1:{free_port}", "no Dask scheduler answers at"),
        ("nonsense", "no Dask scheduler answers at 'nonsense' (it has no port)"),
    ):
        assert main(["sweep", toml, "--out", str(tmp_path / "x"), "--cluster", address]) == 2
        (*_, error) = capsys.readouterr().err.splitlines()
        assert why in error


def test_no_process_of_ours_is_left_behind() -> None:
    orders = [{"name": str(i), "job": {}, "version": "another"} for i in range(3)]
    sweep = run.Sweep(plan.parse({}, "x"), Path(), workers=2)
    answers = list(run._answers(sweep, orders))
    pids = {int(one["where"].split()[-1]) for one in answers}
    assert os.getpid() not in pids
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
