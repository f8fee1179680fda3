"""`controller teach --add NAME`: a few examples of one gesture, learned here and at once."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller import adapt
from controller.adapt import Example
from controller.adapt.examples import LEAD_S, TAIL_S, WINDOWS, guess_symmetries
from controller.adapt.few_shot import Stretch
from controller.bundles import bundle as bundles
from controller.bundles import vocabulary as vocabularies
from controller.bundles.bundle import Bundle
from controller.bundles.vocabulary import ROTATIONS, SELF, Entry
from controller.recognition.images.preprocess import Preprocessor
from controller.recordings import reader
from controller.recordings.recording import Recording
from controller.recordings.writer import alternatives
from controller.shared.aliases import Say
from controller.shared.cues import NULL_LABEL
from controller.shared.errors import UserError, count
from controller.shared.touch_strength import scaled
from controller.teach.session import SessionPlan

EDGE_S: Final = 0.5  # of a label that may belong to what is beside it
MOST: Final = 20  # examples


def plan(given: SessionPlan, label: str, command: str | None, known: Bundle) -> SessionPlan:
    """Return the session in which one gesture is taught; UserError if it cannot be.

    A gesture of the vocabulary keeps its command and the symmetries that it declares there.
    """
    entry = next((one for one in given.vocabulary.entries if one.label == label), None)
    entry = entry or vocabularies.parse(f'[[gesture]]\nlabel = "{label}"', label, Path()).entries[0]
    old = label in known.labels
    if old and not given.user:
        raise UserError(f"{label!r} is known already; --user NAME teaches how one user does it")
    if given.user and not old:
        raise UserError(f"{label!r} is new, and a new gesture is everybody's; leave out --user")
    if old and command is not None:
        raise UserError(f"{label!r} asks for something already; --command is for new gestures")
    if given.repetitions > MOST:
        raise UserError(f"from more than {MOST} examples, train a bundle (orbtouch docs teach)")
    entry = replace(entry, command=command if old else command or entry.command)
    wanted = replace(given.vocabulary, name=label, entries=(entry,))
    return replace(given, out=given.out / label, vocabulary=wanted, rate_hz=known.rate_hz)


def learn(path: Path, recordings: Sequence[Path], plan: SessionPlan, out: Path, say: Say) -> Path:
    """Let a bundle learn a gesture from recordings, and write what it becomes into a folder.

    Raises:
        UserError: There is no example.
        AdaptError: They cannot be learned from.
        BundleError, OSError: The bundle cannot be read or written.
    """
    loaded, (entry,) = bundles.read(path), plan.vocabulary.entries
    examples = [
        replace(one, images=scaled(one.images, loaded.strength_of(plan.user)), user=plan.user)
        for recording in map(reader.load, recordings)
        for one in cut(loaded, recording, entry)
    ]
    if not examples:
        raise UserError("no example was felt, so there is nothing to learn")
    begun = time.monotonic()
    taught = adapt.teach(path.read_bytes(), examples, command=entry.command)
    name = f"{entry.label}-{plan.user}" if plan.user else entry.label
    made = next(one for one in alternatives(out / f"{name}.orb") if not one.exists())
    bundles.write(made, manifest=taught.manifest, parts=taught.parts)
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


def cut(loaded: Bundle, recording: Recording, entry: Entry) -> list[Example]:
    """Return the examples that a recording's cues asked for and got, with the spans of touches.

    Symmetries that the entry does not declare are guessed from them, as the window does.
    """
    asked = (recording.cue == recording.origin.labels.index(entry.label)) & ~recording.excluded
    given = Session.of(loaded, recording).examples(entry.label, asked, np.full(len(asked), ""))
    found = [touch for one in given if (touch := one.found(loaded.rate_hz)) is not None]
    rotations, mirrored = entry.rotations, entry.mirror == SELF
    if rotations == ROTATIONS[0] and not mirrored:
        rotations, mirrored = guess_symmetries(found)
    return [replace(one, rotations=rotations, mirrored=mirrored) for one in found]


@dataclass(frozen=True, slots=True, eq=False)
class Session:
    """A recording as a bundle's network sees it; arrays are of its frames, (n, ...)."""

    images: NDArray[np.float32]  # z, (n, rows, columns)
    ready: NDArray[np.bool_]  # the rest image is known
    part: NDArray[np.int64]  # number of the stretch without lost frames
    rate_hz: float
    window: int  # frames

    @classmethod
    def of(cls, loaded: Bundle, recording: Recording) -> "Session":
        """Return that of a recording."""
        grid, signal = (loaded.rows, loaded.columns), recording.origin.signal
        stage = Preprocessor(loaded.preprocess, *grid, signal=signal)
        steps = [stage.step(frame) for frame in recording.frames]
        images = np.array([step.image for step in steps], dtype=np.float32)
        ready = np.array([step.ready for step in steps])
        part = np.cumsum(np.diff(recording.sequence, prepend=recording.sequence[0]) > 1)
        return cls(images, ready, part.astype(np.int64), loaded.rate_hz, loaded.window)

    def runs(self, chosen: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
        """Yield the first frame of each run of `chosen` frames, (n,), and the one after its last.

        Frames before the rest image is known do not count.
        """
        number = np.where(chosen & self.ready, self.part + 1, 0)
        edges = np.flatnonzero(np.diff(number, prepend=0, append=0))
        for first, end in pairwise(edges.tolist()):
            if number[first]:
                yield first, end

    def examples(
        self, label: str, asked: NDArray[np.bool_], names: NDArray[np.str_]
    ) -> list[Example]:
        """Return an example for each run of `asked` frames, (n,), with the rest around it.

        `names` are the labels, (n,), "" where unknown: frames of other gestures are no rest. Where
        they name the gesture, all that they name is it; else the last touch of a run.
        """
        rest = (names == NULL_LABEL) | (names == "")
        lead, tail = (round(seconds * self.rate_hz) for seconds in (LEAD_S, TAIL_S))
        found = []
        for first, end in self.runs(asked):
            free = self.ready & rest & (self.part == self.part[first])
            before = first - _length(free[max(0, first - lead) : first][::-1])
            one = Example(label, self.images[before : end + _length(free[end : end + tail])])
            if (names[first:end] == label).mean() > 0.5:
                one = one.labelled(first - before, end - before, self.rate_hz)
            found.append(one)
        return found

    def stretches(
        self, label: str, asked: NDArray[np.bool_], names: NDArray[np.str_]
    ) -> list[Stretch]:
        """Return the stretches of other labels: what else is known of the person, but not asked."""
        found: list[Stretch] = []
        every = max(1, self.window // WINDOWS)
        for name in sorted(set(names.tolist()) - {"", label}):
            for first, end in self.runs((names == name) & ~asked):
                edge = min(round(EDGE_S * self.rate_hz), (end - first) // 4)
                ends = np.arange(first + edge, end - edge, every)
                ends = ends[ends >= self.window - 1]
                begins = ends - self.window + 1
                ends = ends[self.ready[begins] & (self.part[begins] == self.part[ends])]
                if len(ends):
                    windows = self.images[ends[:, None] + np.arange(1 - self.window, 1)]
                    found.append((name, windows))
        return found


def _length(chosen: NDArray[np.bool_]) -> int:
    """Return how many of the first frames are chosen, without a gap."""
    return int(np.argmin(np.append(chosen, False)))
