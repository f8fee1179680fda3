"""The store: a bundle proves itself, is taken into use in one step, and there is always one."""

import dataclasses
import multiprocessing
import shutil
import subprocess
import sys
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from controller.__main__ import main
from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.bundles.bundle import Bundle
from controller.bundles.container import BundleError
from controller.bundles.deploy import install, selftest
from controller.bundles.deploy.store import KEEP, RECORD, BundleStore, StoredBundle, name_of
from controller.cli.run import options_of
from controller.runtime.assemble import deployed
from controller.shared import files
from controller.shared.files import LOCK
from tests.support.killed import at_each_call
from tests.support.onnx_files import model, node, value

SHIPPED = bundles.default_path()


@pytest.fixture
def shelf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> BundleStore:
    """An empty store, which is also the one of every command."""
    monkeypatch.setattr("controller.bundles.deploy.store.home", lambda: tmp_path / "shelf")
    return BundleStore()


def variant(folder: Path, number: int) -> Path:
    """A bundle that differs from the shipped one in its card."""
    parts = container.unpack(SHIPPED.read_bytes())
    path = folder / f"{number}.orb"
    card = f'[card]\nvariant = "{number}"\n'.encode()
    text = parts[container.MANIFEST].replace(b"[card]\n", card)
    bundles.write(path, manifest=text, parts={name: parts[name] for name in container.CONTENT})
    return path


def put(shelf: BundleStore, path: Path, corrects: str | None = None) -> str:
    name = name_of(bundles.read(path))
    entry = StoredBundle(name, 50.0, "2026-11-21T12:00:00+00:00", corrects)
    shelf.install(path.read_bytes(), entry)
    return name


_ENTRY = 'corrects = "none"\nstep_us = 5.0\ninstalled = "now"\n'
_NAMED = 'current = "0123456789abcdef"\n[bundles.0123456789abcdef]\n'
DAMAGED = (
    "no TOML [",
    'current = "0123456789abcdef"',
    "current = 7",
    "current = []",
    "",
    "[bundles.x]",
    'current = ""\nbundles = []',
    'current = ""\nbundles.0123456789abcdef = "numpy"',
    'current = ""\nprevious = {}',
    _NAMED,
    _NAMED + _ENTRY.replace("5.0", '"fast"'),
    _NAMED + _ENTRY.replace("5.0", "0x" + "f" * 400),
    _NAMED + _ENTRY.replace("5.0", "nan"),
    _NAMED + _ENTRY.replace('"none"', "[]"),
    f"x = {'[' * 5000}",
    f"x{'.a' * 5000} = 1",
    f"x = {'9' * 5000}",
)


def test_an_installed_bundle_is_used_and_the_old_one_again(
    tmp_path: Path, shelf: BundleStore
) -> None:
    assert shelf.current() == SHIPPED
    one = put(shelf, variant(tmp_path, 1))
    two = put(shelf, variant(tmp_path, 2))
    assert shelf.current() == shelf.path(two)
    assert (shelf.use(one).current, shelf.record().previous) == (one, two)
    assert (shelf.use("").current, shelf.record().previous) == ("", one)
    shelf.path(two).unlink()
    with pytest.raises(BundleError, match="does not exist"):
        shelf.use(two)
    assert shelf.current() == SHIPPED


def test_the_shelf_keeps_the_newest_and_what_is_in_use(tmp_path: Path, shelf: BundleStore) -> None:
    names = [put(shelf, variant(tmp_path, number)) for number in range(KEEP + 3)]
    kept = [entry.name for entry in shelf.record().entries]
    assert kept == names[-KEEP:]
    files = {path.name for path in shelf.folder.iterdir()}
    assert files == {LOCK, RECORD, *(f"{name}.orb" for name in kept)}


def test_corrections_are_taken_back_one_by_one(tmp_path: Path, shelf: BundleStore) -> None:
    """Ten corrections of a bundle of one's own; the shelf keeps eight bundles."""
    names = [put(shelf, variant(tmp_path, 1))]
    for number in range(2, 12):
        names.append(put(shelf, variant(tmp_path, number), corrects=names[-1]))
    assert [entry.name for entry in shelf.record().entries] == [names[0], *names[-7:]]
    went_back = [shelf.undo(correction=True).current for _ in range(7)]
    assert went_back == [*reversed(names[-7:-1]), names[0]]
    with pytest.raises(BundleError, match="there is no change to undo"):
        shelf.undo(correction=True)
    assert shelf.record().previous == names[-7]


def test_undo_takes_back_installations_and_never_goes_forward(
    tmp_path: Path, shelf: BundleStore
) -> None:
    put(shelf, variant(tmp_path, 1))
    two = put(shelf, variant(tmp_path, 2))
    put(shelf, variant(tmp_path, 3), corrects=two)
    assert shelf.undo().current == two
    with pytest.raises(BundleError, match="there is no change to undo"):
        shelf.undo()  # the bundle in use before is the newer one
    put(shelf, variant(tmp_path, 4))
    assert shelf.undo().current == two


def test_undo_ends_at_the_bundle_that_ships(tmp_path: Path, shelf: BundleStore) -> None:
    put(shelf, variant(tmp_path, 1))
    assert shelf.undo().current == ""
    with pytest.raises(BundleError, match="there is no change to undo"):
        shelf.undo()


def test_a_damaged_record_is_said_not_guessed(tmp_path: Path) -> None:
    for text in DAMAGED:
        (tmp_path / RECORD).write_text(text)
        with pytest.raises(BundleError, match=r"is damaged: .*; remove it to go back"):
            BundleStore(tmp_path).current()
    (tmp_path / RECORD).unlink()
    (tmp_path / RECORD).mkdir()
    with pytest.raises(BundleError, match=r"cannot be read: it is a folder.*; remove it"):
        BundleStore(tmp_path).current()


@pytest.mark.parametrize("command", [["install"], ["install", "shipped"]])
def test_a_damaged_record_ends_every_command_in_one_sentence(
    command: list[str], shelf: BundleStore, capsys: pytest.CaptureFixture[str]
) -> None:
    shelf.folder.mkdir()
    (shelf.folder / RECORD).write_text('"\\u001b[31m" = 1\nbundles = []')
    assert main(command) in (1, 2)
    told = capsys.readouterr().err
    assert told.startswith(f"controller: the record {shelf.folder / RECORD} is damaged: ")
    assert told.count("\n") == 1


def test_a_file_that_changes_while_it_is_proved_is_not_installed(
    tmp_path: Path, shelf: BundleStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, other = variant(tmp_path, 1), variant(tmp_path, 2)

    def prove(path: Path, blocks: int) -> selftest.SelfTestResult:
        path.write_bytes(other.read_bytes())
        return selftest.SelfTestResult(50.0, 60.0)

    monkeypatch.setattr(selftest, "run", prove)
    with pytest.raises(BundleError, match="has changed while it was tested"):
        install.install(path, shelf, other_sensor=False, report=lambda _: None)
    assert shelf.current() == SHIPPED


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork")
@pytest.mark.parametrize("change", ["first", "install", "again", "use", "undo"])
def test_a_program_killed_between_any_two_calls_leaves_a_store_that_starts(
    tmp_path: Path, shelf: BundleStore, change: str, caplog: pytest.LogCaptureFixture
) -> None:
    one, two, three = (variant(tmp_path, number) for number in range(3))
    options = options_of(["--sensor", "virtual"])

    def prepare() -> None:
        shutil.rmtree(shelf.folder, ignore_errors=True)
        for path in () if change == "first" else (one, two):
            put(shelf, path)

    def work() -> None:
        if change == "use":
            shelf.use(name_of(bundles.read(one)))
        elif change == "undo":
            shelf.undo()
        else:
            put(shelf, two if change == "again" else three)

    killed = 0
    for _ in at_each_call(work, prepare):
        killed += 1
        bundle, _, _ = deployed(options)
        before, after = SHIPPED if change == "first" else two, {"use": one, "undo": one}
        expected = {bundles.read(path).hash for path in (before, after.get(change, three))}
        assert bundle.hash in expected
        assert all(shelf.path(entry.name).exists() for entry in shelf.record().entries)
        put(shelf, one)  # the next change sweeps
        named = {f"{entry.name}.orb" for entry in shelf.record().entries}
        assert {path.name for path in shelf.folder.iterdir()} == {LOCK, RECORD, *named}
    assert killed > 8
    assert not caplog.records


def test_a_full_disk_changes_nothing(
    tmp_path: Path, shelf: BundleStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, data: bytes) -> None:
        raise OSError(28, "No space left on device")

    old = put(shelf, variant(tmp_path, 1))
    monkeypatch.setattr(files, "atomic_write", full)
    with pytest.raises(OSError, match="No space"):
        put(shelf, SHIPPED)
    assert shelf.record().current == old


# --- the proof ---


def test_the_median_step_is_what_the_clock_says() -> None:
    ticks = count(step=7_000)  # a clock on which every step takes 7 microseconds
    shown = selftest.measure(bundles.read(SHIPPED), lambda: next(ticks))
    assert (shown.step_us, shown.worst_us) == (7.0, 7.0)


def test_a_library_that_kills_its_process_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """As ONNX Runtime does on a processor that it was not built for: status -4, not a word."""

    def run(words: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess(words, -4, "", "")

    monkeypatch.setattr(subprocess, "run", run)
    with pytest.raises(BundleError, match="the self-test ended with status -4 on this device"):
        selftest.run(SHIPPED)


def test_an_operator_s_name_never_acts_on_the_terminal() -> None:
    ends = value(11, "x", 0, 10, 5, 5), value(12, "y", 0, 5)
    odd = model(node("\x1b[2J", "x", "y"), *ends)
    shown = selftest.measure(dataclasses.replace(bundles.read(SHIPPED), embedding_onnx=odd))
    assert "has the operator \\x1b[2J; a device runs" in shown.problem


# --- the commands ---


@pytest.mark.slow
def test_installing(tmp_path: Path, shelf: BundleStore, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["install", str(variant(tmp_path, 1))]) == 0
    out = capsys.readouterr().out
    assert "is whole: press, pinch, twist_cw, twist_ccw; for 5×5 taxels at 40 Hz" in out
    assert "µs a step" in out
    assert "`controller install shipped` goes back" in out
    ours = shelf.record().current
    assert main(["install"]) == 0
    listed = capsys.readouterr().out
    assert "shipped           before  press" in listed
    assert f"{ours}  in use  press" in listed
    assert "variant: 1" in listed
    assert main(["install", "shipped"]) == 0
    assert main(["install", ours[:6]]) == 0
    assert main(["install", ours[:3]]) == 2  # too short to be meant
    printed = capsys.readouterr()
    assert printed.out == f"the shipped bundle is in use\n{ours} is in use\n"
    assert f"{ours[:3]} does not exist" in printed.err


def test_what_a_terminal_would_obey_is_listed_as_an_escape(
    tmp_path: Path, shelf: BundleStore, capsys: pytest.CaptureFixture[str]
) -> None:
    parts = container.unpack(SHIPPED.read_bytes())
    card = '[card]\n"\\u001b]0;key\\u0007" = "\\u202e"\nmade = 1979-05-27\n'
    text = parts[container.MANIFEST].replace(b"[card]\n", card.encode())
    path = tmp_path / "x.orb"
    bundles.write(path, manifest=text, parts=container.content(parts))
    name = name_of(bundles.read(path))
    shelf.install(path.read_bytes(), StoredBundle(name, 50.0, "\x1b[31mto\nday"))
    assert main(["install"]) == 0
    out = capsys.readouterr().out
    assert out.replace("\n", "").isprintable()
    assert "\\x1b]0;key\\x07: \\u202e" in out
    assert "installed \\x1b[31mto\\nday, 50 µs" in out
    assert "made: 1979-05-27" in out


@pytest.mark.skipif(sys.platform != "linux", reason="no /dev/full")
def test_a_list_that_cannot_be_printed_is_one_sentence() -> None:
    words = [sys.executable, "-m", "controller", "install"]
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "controller: cannot write the output: no space left on device\n"


def test_the_list_says_what_is_a_correction_of_what(
    tmp_path: Path, shelf: BundleStore, capsys: pytest.CaptureFixture[str]
) -> None:
    first = put(shelf, variant(tmp_path, 1), corrects="")
    put(shelf, variant(tmp_path, 2), corrects=first)
    assert main(["install"]) == 0
    out = capsys.readouterr().out
    assert "a correction of the shipped bundle" in out
    assert f"a correction of {first}" in out


def test_a_bundle_for_another_sensor_is_refused_unless_asked_for() -> None:
    shipped = bundles.read(SHIPPED)
    other: Bundle = dataclasses.replace(shipped, rows=4, rate_hz=20.0)
    with pytest.raises(BundleError, match=r"for 4×5 taxels at 20 Hz, .* this device has 5×5"):
        install.check_fits(other, shipped)
    denser = dataclasses.replace(shipped, pitch_mm=5.0)
    with pytest.raises(BundleError, match=r"5×5 taxels at 40 Hz, 5 mm apart, and .* 10 mm apart"):
        install.check_fits(denser, shipped)


def test_labels_and_commands_that_no_packet_can_carry_are_not_installed() -> None:
    shipped = bundles.read(SHIPPED)
    install.check_packets(shipped)
    many = tuple(f"{'a' * 30}{number}" for number in range(60))
    with pytest.raises(BundleError, match=r"Welcome has .* use fewer or shorter labels"):
        install.check_packets(dataclasses.replace(shipped, labels=("null", *many)))
    few = ("null", "a" * 40, *(f"a{number}" for number in range(62)))
    large = dataclasses.replace(shipped, labels=few, rows=30, columns=30)
    with pytest.raises(BundleError, match=r"Telemetry has .* use fewer or shorter labels"):
        install.check_packets(large)


@pytest.mark.parametrize("harm", ["damaged", "missing", "record"])
def test_a_run_whose_bundle_cannot_be_used_takes_the_one_that_ships(
    tmp_path: Path, shelf: BundleStore, harm: str, caplog: pytest.LogCaptureFixture
) -> None:
    path = shelf.path(put(shelf, variant(tmp_path, 1)))
    if harm == "damaged":
        path.write_bytes(b"nothing")
    elif harm == "missing":
        path.unlink()
    else:
        (shelf.folder / RECORD).write_text("nothing")
    options = options_of(["--sensor", "virtual"])
    bundle, _, _ = deployed(options)
    assert bundle.hash == bundles.read(SHIPPED).hash
    (warning,) = [record.getMessage() for record in caplog.records]
    assert "the bundle that ships is used" in warning


def test_there_is_a_way_back_from_a_bundle_that_is_missing(
    tmp_path: Path, shelf: BundleStore
) -> None:
    shelf.path(put(shelf, variant(tmp_path, 1))).unlink()
    assert shelf.use("").current == ""


def _install_some(folder: Path, path: Path, failed: Any) -> None:
    try:
        for _ in range(5):
            put(BundleStore(folder), path)
    except Exception as error:  # told by the parent
        failed.put(repr(error))


@pytest.mark.skipif(sys.platform == "win32", reason="needs fork")
def test_programs_that_install_at_once_lose_nothing(tmp_path: Path, shelf: BundleStore) -> None:
    context = multiprocessing.get_context("fork")
    failed = context.SimpleQueue()
    paths = [variant(tmp_path, number) for number in range(3)]
    programs = [
        context.Process(target=_install_some, args=(shelf.folder, path, failed)) for path in paths
    ]
    for program in programs:
        program.start()
    for program in programs:
        program.join()
    assert failed.empty()
    names = {name_of(bundles.read(path)) for path in paths}
    assert {entry.name for entry in shelf.record().entries} == names
    left = {path.name for path in shelf.folder.iterdir()}
    assert left == {LOCK, RECORD, *(f"{name}.orb" for name in names)}
