"""Every file that the device's command line takes, as a special file: one sentence, in no time."""

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from controller.__main__ import main
from controller.cli import COMMANDS
from tests.support.special_files import KINDS, answer, make

if sys.platform != "linux":
    pytest.skip("no such files", allow_module_level=True)

DEMO = "assets/demo.npz"
EMPTY = ("empty", "locked")  # a file without content, which root can read
NEW = ("folder", "missing")
SLOW = ("pipe", "endless", "sparse", "dots")  # kinds for a command that takes its time


@dataclass(frozen=True)
class Row:
    """One use of an option."""

    words: str  # the command line; "@" is the special file, "%" the folder that it is in
    name: str = "special"  # of the special file
    fine: tuple[str, ...] = ()  # kinds that are no mistake here
    prepare: Callable[[Path], object] = lambda folder: None  # writes further files into the folder
    prints: bool = False  # whether the verdict goes to standard output
    kinds: tuple[str, ...] = KINDS  # those that are tried


def _frames(folder: Path) -> None:
    import numpy as np

    np.save(folder / "frames.npy", np.ones((5, 3, 3)))
    (folder / "told.toml").write_text('frames = "frames"\npitch_mm = 1\nrate_hz = 10\n')


# A new option of type Path without a row fails the first test.
ROWS = {
    (" ", "--sensor emulated:"): Row("--sensor emulated:wiring=@"),
    (" ", "--bundle"): Row("--replay {DEMO} --bundle @"),
    (" ", "a gesture's file"): Row("--sensor virtual:gestures=@"),
    (" ", "--mapping"): Row("--replay {DEMO} --mapping @", fine=EMPTY),
    (" ", "--key"): Row("--link listen://127.0.0.1:0 --key @", fine=("missing",)),
    (" ", "--record"): Row("--record @", fine=("folder",)),
    (" ", "--record .npz"): Row("--record @", name="one.npz", fine=NEW),
    (" ", "--replay"): Row("--replay @"),
    (" ", "--link hid:"): Row("--link hid:?keys=@"),
    ("teach", "--out"): Row("teach --out @", fine=NEW),
    ("teach", "--bundle"): Row("teach --out %/out --add wave --bundle @"),
    ("teach", "--sensor emulated:"): Row("teach --out %/out --sensor emulated:wiring=@"),
    ("doctor", "--sensor emulated:"): Row("doctor --sensor emulated:wiring=@", kinds=SLOW),
    ("doctor", "lines:"): Row("doctor --sensor lines:wiring=@"),
    ("doctor", "--out"): Row("doctor --out @"),
    ("install", "bundle"): Row("install @"),
    ("recordings", "paths"): Row("recordings @", prints=True),
    ("recordings import", "sources"): Row(
        "recordings import @ %/told.toml --out %/out", name="x.npy", prepare=_frames
    ),
    ("recordings import", "description"): Row(
        "recordings import %/frames.npy @ --out %/out", prepare=_frames
    ),
    ("recordings import", "--out"): Row(
        "recordings import %/frames.npy %/told.toml --out @", prepare=_frames, fine=NEW
    ),
}


def grammars() -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield the grammar of each command, by its name; " " is the plain run."""

    def caught(grammar: argparse.ArgumentParser, *_: object) -> None:
        raise LookupError(grammar)

    for command in (*(name or " " for name in COMMANDS), "recordings import"):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(argparse.ArgumentParser, "parse_args", caught)
            with pytest.raises(LookupError) as found:
                main(command.split())
        yield command, found.value.args[0]


def test_every_option_that_takes_a_file_has_a_row() -> None:
    options = {
        (command, action.option_strings[-1] if action.option_strings else action.dest)
        for command, grammar in grammars()
        for action in grammar._actions
        if action.type is Path
    }
    assert options - set(ROWS) == set()


@pytest.mark.parametrize(
    ("row", "kind"),
    [
        pytest.param(row, kind, id=f"{' '.join(key).strip()}-{kind}")
        for key, row in ROWS.items()
        for kind in row.kinds
    ],
)
def test_a_special_file_is_refused_in_one_sentence(
    row: Row, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "1000")
    row.prepare(tmp_path)
    special = str(make(kind, tmp_path, row.name))
    words = row.words.format(DEMO=DEMO).split()
    words = [word.replace("@", special).replace("%", str(tmp_path)) for word in words]
    if kind in row.fine and row.words.split("{DEMO}")[0].startswith(("--", "teach --out @")):
        pytest.skip("it would run")
    told = answer(main, words)
    if kind in row.fine:
        assert told.status == 0, told
    elif row.prints:
        assert told.status in (1, 2), told
        assert "Traceback" not in told.error
        assert told.output or told.refused_by("controller"), told
    else:
        assert told.refused_by("controller"), told
