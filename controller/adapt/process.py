"""Changes of a bundle in a process of low priority, so that the control loop does not wait.

Three changes are made here: those of a command and of a touch strength, and the correction in play,
by which a network learns the player's label of the latest touch. `few_shot` has the others.

The child gets a function as a pickle on its standard input, and answers with pickles: the share
that is done, and what the function returns as the last one. The end of its standard input means
that its parent has ended, and ends it.
"""

import contextlib
import math
import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeVar

import tomli_w

from controller.adapt import few_shot
from controller.adapt.examples import LEAD_S, Example, touched
from controller.adapt.few_shot import CORRECTED, AdaptedBundle, AdaptError, Progress
from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.bundles.container import BundleError
from controller.bundles.deploy.store import INCOMING, BundleStore
from controller.recognition.mapping import NONE
from controller.shared.aliases import Images
from controller.shared.cues import NULL_LABEL
from controller.shared.errors import reason
from controller.shared.notices import notice

DEADLINE_S: Final = 120.0
NICE: Final = 10
CHANGES: Final = "changes"  # entry of the card: number of changes since the training
COMMAND: Final = (sys.executable, "-c", "from controller.adapt import process; process.main()")
_ENV: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

# Takes a bundle's file and `progress`; a partial of a function, since it goes to another process.
Change = Callable[..., AdaptedBundle]
Made = TypeVar("Made")
LATEST_S: Final = 2.5  # greatest age of the corrected touch
CORRECTION_LIMIT: Final = 40  # corrections in a bundle


def alter(
    change: Change,
    path: Path,
    folder: Path,
    install: Callable[[Path], object],
    progress: Progress = lambda share: None,
) -> AdaptedBundle:
    """Change a bundle by a process, install the result, and return it without its parts.

    It takes seconds: call this in a thread of its own. `install` takes a file of the folder.

    Raises:
        AdaptError: It is not possible; the message is a sentence.
        OSError: The process cannot be started, or the folder not be made.
        Whatever `install` raises.
    """
    folder.mkdir(parents=True, exist_ok=True)
    out = folder / f"changed-{os.getpid()}.orb"
    try:
        made = run(partial(_made, change, path.resolve(), out), progress)
        install(out)
    finally:
        out.unlink(missing_ok=True)
    return made


def run(
    work: Callable[..., Made],
    progress: Progress = lambda share: None,
    deadline_s: float = DEADLINE_S,
) -> Made:
    """Return what a function that takes `progress` returns, a float never, from a process.

    Raises:
        AdaptError: It is not possible; the message is a sentence.
        OSError: The process cannot be started.
    """
    environment = {**os.environ, **dict.fromkeys(_ENV, "1")}
    began_s = time.monotonic()
    with subprocess.Popen(
        COMMAND, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        deadline = threading.Timer(deadline_s, process.kill)
        deadline.start()
        answer: Any = None
        try:
            with contextlib.suppress(BrokenPipeError, EOFError, pickle.UnpicklingError):
                pickle.dump(work, process.stdin)
                process.stdin.flush()
                while isinstance(answer := pickle.load(process.stdout), float):
                    progress(answer)
            status = process.wait()
        finally:
            deadline.cancel()
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()
    if time.monotonic() - began_s >= deadline_s:
        raise AdaptError(notice("learn_late", deadline_s))
    if isinstance(answer, str):
        raise AdaptError(answer)
    if answer is None or isinstance(answer, float):
        raise AdaptError(notice("learn_ended", status))
    made: Made = answer
    return made


def _made(change: Change, path: Path, out: Path, progress: Progress) -> AdaptedBundle:
    """Write a changed bundle to `out`, and return it without its parts."""
    return write(change(path.read_bytes(), progress=progress), out)


def set_command(
    data: bytes, label: str, command: str, user: str = "", progress: Progress = lambda share: None
) -> AdaptedBundle:
    """Return a bundle with another command of a gesture, "" nothing.

    With a user, only that user's mapping changes; with "" as the label it is removed.

    Raises:
        AdaptError, BundleError: It is not possible.
    """
    loaded, parts = bundles.parse(data), container.unpack(data)
    if user and user not in loaded.users.names:
        raise AdaptError(notice("unknown_user", user))
    if label not in loaded.labels[1:] and (label or not user):
        raise AdaptError(notice("no_gesture", label))
    table = container.manifest(parts[container.MANIFEST])
    mappings = table["users"].setdefault("mapping", {}) if user else {"": table["mapping"]}
    if label:
        mappings.setdefault(user, {})[label] = command or NONE
    else:
        mappings.pop(user, None)
    progress(1.0)
    return AdaptedBundle(tomli_w.dumps(table).encode(), container.content(parts))


def set_strength(
    data: bytes, strength: float, user: str = "", progress: Progress = lambda share: None
) -> AdaptedBundle:
    """Return a bundle with another touch strength of a user, or of everybody without one.

    With 0 the user has none any more.

    Raises:
        AdaptError, BundleError: It is not possible.
    """
    loaded, parts = bundles.parse(data), container.unpack(data)
    if user and user not in loaded.users.names:
        raise AdaptError(notice("unknown_user", user))
    table = container.manifest(parts[container.MANIFEST])
    place, key = (table["users"].setdefault("strength", {}), user) if user else (table, "strength")
    place.pop(key, None)
    if strength:
        place[key] = strength
    progress(1.0)
    return AdaptedBundle(tomli_w.dumps(table).encode(), container.content(parts))


def write(made: AdaptedBundle, out: Path) -> AdaptedBundle:
    """Write a changed bundle, and return it without its parts; BundleError, OSError."""
    bundles.write(out, manifest=counted(made.manifest), parts=made.parts)
    return replace(made, manifest=b"", parts={})


def counted(manifest: bytes) -> bytes:
    """Return a manifest whose card counts one more change, so that no two in a row are equal."""
    table = container.manifest(manifest)
    before = table["card"].get(CHANGES, 0)
    table["card"][CHANGES] = before + 1 if isinstance(before, int) else 1
    return tomli_w.dumps(table).encode()


def example(label: str, images: Images, rate_hz: float) -> Example:
    """Return the latest touch in images as an example; AdaptError: none, or a weak one."""
    cut = latest(images, rate_hz)
    if cut is None:
        raise AdaptError(notice("late", LATEST_S))
    found = Example(label, cut).found(rate_hz)
    if found is None:
        raise AdaptError(notice("weak_touch"))
    if label == NULL_LABEL:
        return Example(label, cut, span=(0.0, float(len(cut))))
    return found


def latest(images: Images, rate_hz: float) -> Images | None:
    """Return the images around the latest touch, (frames, rows, columns); None without a touch."""
    touches = touched(images, rate_hz) if len(images) >= 3 else []
    if not touches or touches[-1].span[1] < len(images) - LATEST_S * rate_hz:
        return None
    before = math.ceil(touches[-2].span[1]) if len(touches) > 1 else 0
    first = math.ceil(touches[-1].span[0]) - round(LEAD_S * rate_hz)
    return images[max(before, first) :]


def correct(
    label: str,
    images: Images,
    rate_hz: float,
    store: BundleStore,
    install: Callable[[Path, str], str],
) -> str:
    """Learn the label of the latest touch, take the new bundle into use, and return a sentence.

    Training takes seconds: call this in a thread of its own. The label "null" is no gesture, and ""
    takes the last correction back. `install` tests a file and takes it into use, given the name of
    the bundle that it corrects.

    Raises:
        BundleError, AdaptError, OSError: Nothing has changed; the message has the reason.
    """
    if not label:
        left = _corrections(store.path(store.undo(correction=True).current))
        return notice("taken_back", left)
    before = store.record().current
    path = store.path(before, rate_hz)
    count = _corrections(path)
    if count >= CORRECTION_LIMIT:
        raise AdaptError(notice("many_corrections", CORRECTION_LIMIT))
    shown = [example(label, images, rate_hz)]
    word = notice("nothing") if label == NULL_LABEL else notice("gesture", label)
    change = partial(few_shot.teach, examples=shown, note=CORRECTED + word)
    alter(change, path, store.folder / INCOMING, lambda out: install(out, before))
    return notice("corrected", word, count + 1)


def _corrections(path: Path) -> int:
    """Return the number of corrections in a bundle."""
    return sum(str(note).startswith(CORRECTED) for note in bundles.read(path).card.get("added", []))


def _end_with(pipe: int) -> None:
    """End the process when the other end of a pipe is closed."""
    while os.read(pipe, 1):
        pass
    os._exit(1)


def main() -> None:
    """Make the change on standard input."""
    if hasattr(os, "nice"):
        os.nice(NICE)
    work = pickle.load(sys.stdin.buffer)
    threading.Thread(target=_end_with, args=(sys.stdin.fileno(),), daemon=True).start()

    def say(answer: object) -> None:
        pickle.dump(answer, sys.stdout.buffer)
        sys.stdout.buffer.flush()

    try:
        say(work(progress=say))
    except (AdaptError, BundleError) as error:
        say(str(error))
    except OSError as error:
        say(notice("cannot_keep", reason(error)))
