"""`controller teach --add NAME`: a few examples of one gesture, learned here and at once."""

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np
import tomli_w
from numpy.typing import NDArray

from controller import adapt
from controller.adapt import Example
from controller.aliases import Say
from controller.bundles import bundle as bundles
from controller.bundles import vocabulary as vocabularies
from controller.bundles.bundle import Bundle
from controller.bundles.deploy.store import BundleStore
from controller.bundles.vocabulary import SELF, Entry, Vocabulary
from controller.errors import count
from controller.recognition.preprocess import Preprocessor
from controller.recordings import reader
from controller.recordings.recording import Recording
from controller.teach import TeachError

LEAD_S: Final = 1.3  # of what was before a go: a window of rest, and more
TAIL_S: Final = 0.5  # of what came after: who is told to rest is still letting go
MOST, USUAL = 20, 5  # examples


def source(options: argparse.Namespace) -> Path:
    """Return the bundle that is to learn: the named one, else that in use."""
    return Path(options.bundle or BundleStore().current(options.rate))


def vocabulary(options: argparse.Namespace, known: Bundle) -> Vocabulary:
    """Return the gesture to be taught as a vocabulary of one; TeachError if it cannot be."""
    label, given = options.add, None
    if options.labels is not None:
        listed = vocabularies.read(options.labels)
        given = next((one for one in listed.entries if one.label == label), None)
        if given is None:
            raise TeachError(
                f"{options.labels} has no gesture {label!r}; it has {', '.join(listed.labels[1:])}"
            )
    old = label in known.labels
    if old and not options.user:
        raise TeachError(f"{label!r} is known already; --user NAME teaches how somebody does it")
    if options.user and not old:
        raise TeachError(f"{label!r} is new, and a new gesture is everybody's; leave out --user")
    if old and options.command is not None:
        raise TeachError(f"{label!r} asks for something already; --command is for new gestures")
    if options.repetitions > MOST:
        raise TeachError(f"from more than {MOST} examples, train a bundle (docs/teach.md)")
    entry = given or Entry(label, label.replace("_", " "), options.rotations, options.mirror)
    if options.command is not None:
        entry = replace(entry, command=options.command)
    if entry.mirror not in (SELF, vocabularies.NO_MIRROR):
        entry = replace(entry, mirror=vocabularies.NO_MIRROR)  # the other one is not taught here
    return vocabularies.parse(_text(entry), f"--add {label}", Path())


def _text(entry: Entry) -> str:
    """Return a vocabulary of one gesture as TOML."""
    file = None if entry.file is None else str(entry.file.resolve())
    table = {name: getattr(entry, name) for name in ("label", "say", "rotations", "mirror")}
    given = {"command": entry.command, "file": file}
    table |= {name: value for name, value in given.items() if value is not None}
    return tomli_w.dumps({"name": entry.label, "gesture": [table]})


def learn(
    path: Path, recordings: Sequence[Path], entry: Entry, user: str, out: Path, say: Say
) -> Path:
    """Let a bundle learn an entry from recordings, and write what it becomes into a folder.

    `user`: whose way of doing an old gesture it is; "": it is new, or everybody's.

    Raises:
        TeachError: There is no example.
        AdaptError: They cannot be learned from.
        BundleError, OSError: The bundle cannot be read or written.
    """
    loaded = bundles.read(path)
    examples = [
        replace(one, user=user)
        for recording in map(reader.load, recordings)
        for one in cut(loaded, recording, entry)
    ]
    if not examples:
        raise TeachError("no example was felt, so there is nothing to learn")
    begun = time.monotonic()
    taught = adapt.teach(path.read_bytes(), examples, command=entry.command)
    made = _free(out, f"{entry.label}-{user}" if user else entry.label)
    taught.write(made)
    say(
        f"{entry.label} is learned from {count(len(examples), 'example')} in "
        f"{time.monotonic() - begun:.1f} s; of the gestures that were rehearsed "
        f"{taught.kept:.1%} are taken for what they were"
    )
    waiting = [label for label in taught.debounce.patient if label not in loaded.debounce.patient]
    if waiting:
        say(
            f"{entry.label} begins like {' and '.join(waiting)}, which now waits "
            f"{taught.debounce.patience_s:.2f} s for it"
        )
    return made


def cut(loaded: Bundle, recording: Recording, entry: Entry) -> Iterator[Example]:
    """Yield the examples that a recording's cues asked for and got."""
    own = recording.origin.labels.index(entry.label)
    asked = (recording.cue == own) & ~recording.excluded
    for images in around(loaded, recording, asked):
        example = Example(
            entry.label, images, rotations=entry.rotations, mirrored=entry.mirror == SELF
        )
        if example.found(loaded.rate_hz) is not None:
            yield example


def around(
    loaded: Bundle, recording: Recording, asked: NDArray[np.bool_]
) -> Iterator[NDArray[np.float32]]:
    """Yield the z images of each run of `asked` frames, (n,), with some before and after.

    Frames before the rest image is known do not count.
    """
    grid, signal = (loaded.rows, loaded.columns), recording.origin.signal
    stage = Preprocessor(loaded.preprocess, *grid, signal=signal)
    steps = [stage.step(frame) for frame in recording.frames]
    images = np.array([step.image for step in steps], dtype=np.float32)
    ready = np.array([step.ready for step in steps])
    edges = np.flatnonzero(np.diff((asked & ready).astype(np.int8), prepend=0, append=0))
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        lead = max(first - round(LEAD_S * loaded.rate_hz), int(ready.argmax()))
        yield images[lead : end + round(TAIL_S * loaded.rate_hz)]


def _free(out: Path, name: str) -> Path:
    """Return a file that is not there yet."""
    number, path = 1, out / f"{name}.orb"
    while path.exists():
        number += 1
        path = out / f"{name}-{number}.orb"
    return path
