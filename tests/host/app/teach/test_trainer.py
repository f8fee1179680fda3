"""Training in child processes: here a small program that prints what `models` prints."""

import json
import sys
import threading
from pathlib import Path

import pytest

from host.app.screens.teach import trainer
from host.app.screens.teach.trainer import GestureResult, TrainingProgress, TrainingRun

NAMES = ("train", "tune", "evaluate")
VERDICT = {"label": "twist_cw", "understood": 13, "of": 20, "why": "too short", "advice": "longer"}


def finish(run: TrainingRun) -> None:
    """Let a training come to its end."""
    while run.step:
        run._process.wait(20.0)
        run._reader.join(20.0)
        run.poll()


def test_progress_follows_the_epochs_that_are_printed() -> None:
    progress = TrainingProgress(NAMES)
    assert (progress.share, progress.left_s(1.0)) == (0.0, None)
    progress.take("on cpu, one thread")
    progress.take("CNN-3D epoch 50/100: loss 0.041, unseen 0.027, right 98.9%")
    assert progress.share == pytest.approx(0.5 * trainer.SHARES["train"])
    assert progress.left_s(30.0) == pytest.approx(30.0 * 0.69 / 0.31)  # 31 % took 30 s
    for _ in NAMES:
        progress.next()
    assert progress.share == 1.0


@pytest.mark.parametrize("line", ["", "epoch", "epoch 3/0", "epoch x/y", "\x1b[2K", "9" * 500])
def test_other_lines_are_no_progress(line: str) -> None:
    progress = TrainingProgress(NAMES)
    progress.take(line)
    assert progress.share == 0.0


def test_the_newest_session_is_only_judged() -> None:
    sessions = [Path("1.npz"), Path("2.npz"), Path("3.npz")]
    *makes, judges = trainer.steps(sessions, Path("my.orb"), Path("found.json"))
    for step in makes:
        assert {"1.npz", "2.npz"} <= {*step}
        assert "3.npz" not in step
    assert judges == ("evaluate", "my.orb", "3.npz", "--json", "found.json")


def test_steps_run_one_after_the_other(tmp_path: Path) -> None:
    heard = tmp_path / "heard"
    script = f"import sys; print(*sys.argv[1:], file=open({str(heard)!r}, 'a'))"
    run = TrainingRun([(name, "x") for name in NAMES], (sys.executable, "-c", script))
    assert run.step == "train"
    finish(run)
    assert (run.step, run.problem, run.progress.share) == ("", "", 1.0)
    assert heard.read_text().splitlines() == [f"{name} x" for name in NAMES]


def test_a_failed_step_ends_it_with_its_last_sentence(tmp_path: Path) -> None:
    script = "import sys; sys.exit('models: nothing can be learned from 1 recording')"
    run = TrainingRun([("train",), ("tune",)], (sys.executable, "-c", script))
    finish(run)
    assert run.problem == "nothing can be learned from 1 recording"


def test_a_stopped_training_leaves_no_process() -> None:
    run = TrainingRun([("train",), ("tune",)], (sys.executable, "-c", "input()"))
    run.stop()
    assert run._process.returncode is not None
    run.poll()
    assert (run.step, run.problem) == ("", "")


def test_the_process_ends_with_its_run() -> None:
    wait = "import threading; threading.Event().wait()"
    run = TrainingRun([("train",)], (sys.executable, "-c", wait))
    process, reader = run._process, run._reader
    del run  # as when the window is closed
    assert process.returncode is not None
    reader.join(20.0)
    assert reader not in threading.enumerate()


def test_results_are_those_of_an_evaluation(tmp_path: Path) -> None:
    found = tmp_path / "found.json"
    found.write_text(json.dumps({"results": [{"verdict": [VERDICT]}]}))
    assert trainer.results(found) == [GestureResult("twist_cw", 13, 20, "too short; longer")]


@pytest.mark.parametrize("text", ["", "[]", '{"results": []}', '{"results": [{"verdict": [{}]}]}'])
def test_other_files_are_refused(tmp_path: Path, text: str) -> None:
    found = tmp_path / "found.json"
    with pytest.raises(ValueError, match="cannot be read"):
        trainer.results(found)
    found.write_text(text)
    with pytest.raises(ValueError, match="is no evaluation"):
        trainer.results(found)
