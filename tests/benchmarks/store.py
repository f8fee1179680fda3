"""Three programs change one store of bundles at once, and are killed at random times.

    python -m tests.benchmarks.store [--changes N] [--kills N] [--recordings N] [--seed N] [--json]

Each installs, rolls back or undoes; every so often one gets SIGKILL and is replaced. The record
must always be whole, and name files that are there; in the end nothing may be left over. Then
programs that record or seal are killed; every other journal is recovered, "delete all" is done, and
nothing may be left either. Needs fork.
"""

import multiprocessing
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from multiprocessing.context import ForkProcess
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path

from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.bundles.container import BundleError
from controller.bundles.deploy.store import RECORD, BundleStore, StoredBundle, name_of
from controller.recordings import journal_file
from controller.recordings.recording import RecordingError
from controller.remote import link_recording
from controller.shared import leftovers

from .killed_recordings import AT_ONCE, Life, kill, record, seal
from .results import Results, command_line, say

PROGRAMS = 3
VARIANTS = 6


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
    context, draw = multiprocessing.get_context("fork"), random.Random(options.seed)
    seen, ends = Counter[str](), Counter[int]()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "bundles"
        made, done = variants(Path(place)), context.Value("i", 0)

        def begin(number: int) -> ForkProcess:
            arguments = folder, made, draw.randrange(1 << 30), done, options.changes
            process = context.Process(target=change, args=arguments)
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
        left = {path.name for path in folder.iterdir()} - named - {RECORD, leftovers.LOCK}
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
