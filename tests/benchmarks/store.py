"""Three programs change one store of bundles at once, and are killed at random times.

    python -m tests.benchmarks.store [--changes N] [--kills N] [--recordings N] [--seed N] [--json]

Each installs, rolls back or undoes; every so often one gets SIGKILL and is replaced. The record
must always be whole, and name files that are there; in the end nothing may be left over. Then
programs that record or seal are killed; every other journal is recovered, "delete all" is done, and
nothing may be left either. Needs fork.
"""

import contextlib
import multiprocessing
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.context import ForkProcess
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path
from typing import Any, Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.bundles.container import BundleError
from controller.bundles.deploy.store import RECORD, BundleStore, StoredBundle, name_of
from controller.recognition.images.frames import Frame
from controller.recordings import journal_file
from controller.recordings.recorder import SYNC_S, Recorder
from controller.recordings.recording import Provenance, RecordingError
from controller.remote import link_recording
from controller.shared import files

from .results import Results, command_line, say

PROGRAMS = 3
VARIANTS = 6
RATE_HZ: Final = 100.0
AT_ONCE: Final = 10  # processes
LABELS: Final = ("null", "press", "pinch")
ORIGIN: Final = Provenance("benchmark", 5, 5, 10.0, RATE_HZ, LABELS, "", "", "")
FORK: Final = multiprocessing.get_context("fork")


def frame_of(seed: int, number: int) -> Frame:
    """Return a frame of a seed, made from its number alone."""
    return np.random.default_rng((seed, number)).normal(41.2, 2.9, (5, 5)).astype(np.float32)


@dataclass
class Life:
    """A process, and what it had done when it was killed."""

    folder: Path
    seed: int
    span_s: float  # from its start, or from when it says `ready`, until it is killed
    waits: bool = False  # for `ready`
    added: Any = field(default_factory=lambda: FORK.Value("q", 0, lock=False))  # frames
    ready: Any = field(default_factory=FORK.Event)


def record(life: Life) -> None:
    """Record on an absolute schedule until killed."""
    recorder = Recorder(life.folder / "one.npz", ORIGIN, {})
    start = time.monotonic()
    for number in range(1, 1 << 40):
        time.sleep(max(0.0, start + number / RATE_HZ - time.monotonic()))
        _add(recorder, life.seed, number)
        life.added.value = number


def _add(recorder: Recorder, seed: int, number: int) -> None:
    t_s, label = number / RATE_HZ, number % len(LABELS)
    recorder.journal.add_frame(frame_of(seed, number), t_s, number, (label, -1, -1, -1))


def seal(life: Life) -> None:
    """Record a lot at once and seal it; killed meanwhile."""
    recorder = Recorder(life.folder / "one.npz", ORIGIN, {})
    for number in range(1, 1001):
        _add(recorder, life.seed, number)
    time.sleep(2 * SYNC_S)  # then all is on the disk, and a crash may cost nothing
    life.added.value = 1000
    life.ready.set()
    recorder.close()


def kill(lives: list[Life], work: Callable[[Life], None], number: int = signal.SIGKILL) -> None:
    """Run the lives, some at once, and end each at its time with a signal."""
    step = 1 if any(life.waits for life in lives) else AT_ONCE
    for first in range(0, len(lives), step):
        running = []
        for life in lives[first : first + step]:
            process = FORK.Process(target=work, args=(life,), daemon=True)
            process.start()
            if life.waits:
                life.ready.wait(60.0)
            running.append((time.monotonic() + life.span_s, process))
        for end, process in sorted(running, key=lambda run: run[0]):
            time.sleep(max(0.0, end - time.monotonic()))
            with contextlib.suppress(ProcessLookupError):
                os.kill(process.pid or 0, number)
            process.join()


def variants(folder: Path) -> list[tuple[str, bytes]]:
    """Return the names and files of bundles that differ in their cards."""
    parts = container.unpack(bundles.default_path().read_bytes())
    found = []
    for number in range(VARIANTS):
        path, card = folder / f"{number}.orb", f'[card]\nvariant = "{number}"\n'
        text = parts[container.MANIFEST].replace(b"[card]\n", card.encode())
        content = {name: parts[name] for name in container.CONTENT}
        bundles.write(path, manifest=text, parts=content)
        found.append((name_of(bundles.read(path)), path.read_bytes()))
    return found


def change(
    folder: Path, made: list[tuple[str, bytes]], seed: int, done: "Synchronized[int]", limit: int
) -> None:
    """Change the store again and again."""
    draw, store = random.Random(seed), BundleStore(folder)
    while done.value < limit:
        kind = draw.choice(("install", "install", "use", "undo"))
        with suppress(BundleError):  # nothing to go back to
            if kind == "install":
                name, data = draw.choice(made)
                store.install(data, StoredBundle(name, 1.0, "now"))
            elif kind == "use":
                store.use(store.record().previous or "")
            else:
                store.undo()
        with done.get_lock():
            done.value += 1


def state(folder: Path) -> str:
    """Return what a start would find: "sound", or what is wrong."""
    store = BundleStore(folder)
    try:
        record = store.record()
    except BundleError as error:
        return f"no record: {error}"
    for entry in record.entries:
        if not store.path(entry.name).exists() and store.record() == record:
            return "a file that the record names is missing"
    return "sound"


def recordings(count: int, draw: random.Random) -> list[str]:
    """Kill programs that record, and return the files that are left after "delete all"."""
    left = []
    with tempfile.TemporaryDirectory() as place:
        for number in range(0, count, AT_ONCE):
            work = (record, seal)[number // AT_ONCE % 2]
            span_s = 0.1 if work is seal else 1.0
            folders = [Path(place) / f"{number + one}" for one in range(AT_ONCE)]
            lives = []
            for folder in folders:
                folder.mkdir()
                lives.append(Life(folder, number, draw.uniform(0.0, span_s), waits=work is seal))
            kill(lives, work)
            for folder in folders:
                for journal in journal_file.leftovers(folder) if draw.random() < 0.5 else ():
                    with suppress(RecordingError):  # it holds no frame yet
                        journal_file.recover(journal)
                link_recording.delete(folder)
                left += [str(path) for path in folder.rglob("*")]
            say(f"{number + AT_ONCE} programs that recorded were killed; left: {len(left)} files")
    return left


def main() -> None:
    """Run the programs, kill some, and look at the store."""
    parser = command_line(__doc__, changes=2000, kills=200, recordings=300, seed=1)
    options, results = parser.parse_args(), Results("store")
    if sys.platform == "win32":
        raise SystemExit("this needs fork: Linux or macOS")
    draw = random.Random(options.seed)
    seen, ends = Counter[str](), Counter[int]()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "bundles"
        made, done = variants(Path(place)), FORK.Value("i", 0)

        def begin(number: int) -> ForkProcess:
            arguments = folder, made, draw.randrange(1 << 30), done, options.changes
            process = FORK.Process(target=change, args=arguments)
            process.start()
            return process

        running = [begin(number) for number in range(PROGRAMS)]
        killed = 0
        while done.value < options.changes:
            time.sleep(draw.uniform(0.005, 0.05))
            if killed < options.kills * done.value / options.changes:
                victim = draw.randrange(PROGRAMS)
                running[victim].kill()
                running[victim].join()
                killed += 1
                seen[state(folder)] += 1
                running[victim] = begin(victim)
                if killed % 50 == 0:
                    say(f"{killed} kills, {done.value} changes: {dict(seen)}")
        for process in running:
            process.join()
            ends[process.exitcode or 0] += 1
        seen[state(folder)] += 1
        store = BundleStore(folder)
        name, data = made[0]
        store.install(data, StoredBundle(name, 1.0, "now"))  # which sweeps
        named = {f"{entry.name}.orb" for entry in store.record().entries}
        left = {path.name for path in folder.iterdir()} - named - {RECORD, files.LOCK}
    assert set(ends) <= {0, -signal.SIGKILL}
    results.note("store_changes", done.value)
    results.note("store_kills", killed)
    results.note("store_unsound", sum(seen.values()) - seen["sound"], goal=0)
    results.note("store_left_over", len(left), "files", goal=0)
    lost = recordings(options.recordings, draw)
    results.note("recordings_left_over", len(lost), "files", goal=0)
    for kind in seen:
        results.note(kind, seen[kind])
    results.finish(options.json)


if __name__ == "__main__":
    main()
