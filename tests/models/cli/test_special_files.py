"""Every file option of the training machine, given files that never end, never answer, or lie."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from controller.bundles.bundle import default_path
from controller.recordings import writer
from models.__main__ import main
from models.data.simulate import DataSet
from models.studies.sweep import run
from tests.support.pytest_types import Patch
from tests.support.special_files import KINDS, answer, make

BUNDLE = str(default_path())
NEEDS_TORCH = pytest.mark.train
# A name that is free, and files that may be replaced.
REPLACEABLE = ("missing", "sparse", "locked", "unreadable", "dangling", "empty", "binary", "dots",
               "brackets", "json", "digits", "sequences")  # fmt: skip
UNFIT = [kind for kind in KINDS if kind not in REPLACEABLE]

# What is read: the option's words, with {} for the file and {data} for a folder.
READ = [
    pytest.param(words, marks=NEEDS_TORCH if words.split()[0] in torch else (), id=name)
    for torch in [("train", "folds", "sweep", "paper")]
    for name, words in {
        "evaluate BUNDLE": "evaluate {}",
        "evaluate DATA": f"evaluate {BUNDLE} {{}}",
        "simulate --gestures": "simulate --out {data}/new --gestures {}",
        "train DATA": "train {} --out {data}/new.orb",
        "train --from": "train {data} --epochs 0 --from {} --out {data}/new.orb",
        "train --with": "train {data} --task gesture --with {} --out {data}/new.orb",
        "train --auxiliary": "train {} --task gesture --auxiliary {} --out {data}/new.orb",
        "train --others": "train {} --task user --others {} --out {data}/new.orb",
        "folds DATA": "folds {} --out {data}/new",
        "sweep FILE": "sweep {}",
        "paper BUNDLE": "paper {} --out {data}",
        "paper DATA": f"paper {BUNDLE} {{}} --out {{data}}",
    }.items()
]
# What is written: it is refused before anything is done.
WRITTEN = [
    pytest.param(words, marks=NEEDS_TORCH if words.split()[0] in torch else (), id=words)
    for torch in [("train",)]
    for words in (
        "evaluate --json {}",
        "train {data} --out {}",
        "train {data} --task user --out {}",
        f"train {{data}} --epochs 0 --from {BUNDLE} --out {{}}",
    )
]


@pytest.fixture(scope="module")
def recorded() -> bytes:
    """A short recording."""
    return writer.pack(DataSet(minutes=0.5).session(0, 0))


def refused(words: str, special: Path, data: Path, status: int = 2) -> None:
    told = answer(main, [one.format(special, data=data) for one in words.split()])
    assert told.refused_by("models"), told
    assert told.status == status
    assert not told.output


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("words", READ)
def test_what_cannot_be_read_is_one_sentence(words: str, kind: str, tmp_path: Path) -> None:
    if words == "sweep {}" and kind in ("empty", "locked"):
        pytest.skip("an empty file asks for a sweep with every setting as it is")
    data = tmp_path / "data"
    data.mkdir()
    refused(words, make(kind, tmp_path, "special.toml"), data)


@pytest.mark.parametrize("kind", UNFIT)
@pytest.mark.parametrize("words", WRITTEN)
def test_what_cannot_be_replaced_is_refused_at_once(words: str, kind: str, tmp_path: Path) -> None:
    special = make(kind, tmp_path, "special.orb")
    refused(words, special, tmp_path)
    assert not special.is_file()
    assert special.exists() or special.is_symlink()


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "missing"])
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("dataset.json", "simulate --out {data} --users 1 --sessions 1 --minutes 0.5"),
        pytest.param("paper.json", "paper --out {data}", marks=NEEDS_TORCH),
    ],
)
def test_file_in_a_folder_is_one_sentence(name: str, words: str, kind: str, tmp_path: Path) -> None:
    if kind == "dangling":
        pytest.skip("it is replaced, as if there were none")
    make(kind, tmp_path, name)
    # That a name leads to itself is found out when something is to be written there.
    late = kind == "loop" and name == "dataset.json"
    refused(words, tmp_path, tmp_path, 1 if late else 2)


@pytest.mark.train
@pytest.mark.parametrize("kind", KINDS[1:])
def test_unreadable_vocabulary_is_one_sentence(kind: str, tmp_path: Path, recorded: bytes) -> None:
    (tmp_path / "it.npz").write_bytes(recorded)
    make(kind, tmp_path, "gestures.toml")
    refused("train {data}/it.npz --out {data}/x.orb", tmp_path, tmp_path)


@pytest.mark.parametrize("kind", KINDS)
def test_a_finished_training_that_cannot_be_read_is_done_again(kind: str, tmp_path: Path) -> None:
    (tmp_path / run.JOBS).mkdir()
    make(kind, tmp_path / run.JOBS, "special.json")
    assert run.answers(tmp_path) == {}


@pytest.mark.parametrize(
    "change",
    [
        lambda one: one["result"].update(held=[{}]),
        lambda one: one["result"]["held"][0].update(events=["many", 20]),
        lambda one: one["result"].update(learned={}),
        lambda one: one["result"].update(notes=7),
        lambda one: one.update(result=[]),
        lambda one: one.pop("name"),
    ],
)
def test_other_shape_trains_again(change: Callable[[dict[str, Any]], Any], tmp_path: Path) -> None:
    learned = {"users": 1, "sessions": 1, "minutes": 3.0, "windows": 100}
    held = [{"user": "4", "session": "4 01", "frames": [80, 90], "events": [9, 20]}]
    result = {"learned": learned, "notes": [], "random": 0.99, "held": held}
    one = {"name": "n", "result": result, "where": "here 1", "cpu_s": 1.0}
    (tmp_path / run.JOBS).mkdir()
    path = tmp_path / run.JOBS / "n.json"
    path.write_text(json.dumps(one))
    assert set(run.answers(tmp_path)) == {"n"}
    change(one)
    path.write_text(json.dumps(one))
    assert run.answers(tmp_path) == {}


def test_a_full_disk_names_the_file_and_leaves_no_half(tmp_path: Path, monkeypatch: Patch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    kept = tmp_path / "figures.json"
    kept.write_text("the old one")
    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", full)
        words = ["evaluate", "--sessions", "1", "--minutes", "0.5", "--json", str(kept)]
        told = answer(main, words)
    assert told.status == 1
    assert told.error.splitlines()[-1] == f"models: {kept}: no space left on device"
    assert kept.read_text() == "the old one"
    assert list(tmp_path.iterdir()) == [kept]


@pytest.mark.train
def test_a_checkpoint_that_holds_something_else_is_damaged(tmp_path: Path) -> None:
    import numpy as np

    from models.training import checkpoint

    path = tmp_path / "kept.npz"
    for words in ("[" * 50_000, "9" * 5_000, "no JSON"):
        np.savez(path, words=np.array(words))
        with pytest.raises(checkpoint.CheckpointError, match="is damaged; remove it"):
            checkpoint.load(path)
