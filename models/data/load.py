"""Load folders of recordings as examples: check each, choose its labels, find its group."""

import hashlib
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles import vocabulary as vocabularies
from controller.bundles.vocabulary import FILE, Vocabulary
from controller.console import count
from controller.recognition.frames import PreprocessSettings
from controller.recordings.quality import check
from controller.recordings.quality.duplicates import FrameIndex
from controller.recordings.quality.response import respond
from controller.recordings.recording import PICOFARAD, RATE_TOLERANCE, UNKNOWN, Recording
from models.data import label_repair
from models.data.examples import (
    COLUMNS,
    Choice,
    Examples,
    Labels,
    Recordings,
    Source,
    digest,
    prepare,
    read_training,
)
from models.data.ground_truth import true_places
from models.data.recipe import Recipe
from models.results.training import Lateness, SessionRow

Say = Callable[[str], None]

WINDOW_S: Final = 1.0  # paper, section 5: a buffer of one second
WINDOWS: Final = (4, 250)  # images; a bundle holds no more
# What a firm touch is on the orb, mean of |z - 1|; other sensors are scaled to it, because the
# device's gate and the networks' first layer are made for it. Measured on simulated presses.
FIRM: Final = 0.08
KNOWN: Final = 0.5  # share of frames from which on the truth counts as known
SAMPLED: Final = 8  # recordings from which a scale is taken
SAID: Final = 3  # recordings left out that an error names


@dataclass(frozen=True, slots=True)
class Data:
    """What there is to learn from.

    Attributes:
        examples: Of all sessions; `examples.session` counts `rows`.
        rows: What is known of each recording, held out or not.
        session: Group of each recording: parts of one session are one.
        user: Group of each recording: those of one user are one.
        vocabulary: Its gestures.
        settings: How images and windows are made.
        pitch_mm: Of the sensor.
        unit: Of the frames.
        digest: SHA-256 over all files, in order.
        notes: What was left out, in sentences.
    """

    examples: Examples
    rows: tuple[SessionRow, ...]
    session: NDArray[np.int64]
    user: NDArray[np.int64]
    vocabulary: Vocabulary
    settings: PreprocessSettings
    pitch_mm: float
    unit: str
    digest: str
    notes: tuple[str, ...] = ()


@dataclass(slots=True)
class _Found:
    """Facts on the recordings, collected while they are read."""

    rows: list[SessionRow] = field(default_factory=list)
    session: list[str] = field(default_factory=list)
    user: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    copies: FrameIndex = field(default_factory=FrameIndex)


def read(
    paths: Sequence[Path],
    recipe: Recipe,
    choice: Choice,
    say: Say,
    *,
    window: int = 0,
    every: bool = False,
) -> Data:
    """Read data sets, and make examples of them.

    Args:
        paths: Folders and files.
        recipe: How networks will be trained.
        choice: Whose labels are learned.
        say: Takes lines of progress.
        window: Images in a window; 0: those of a second.
        every: Recordings that fail the check are taken too.

    Raises:
        ValueError: There is nothing to learn from; one sentence.
    """
    recordings = read_training(paths)
    origin = recordings.surveys[0].origin
    vocabulary = vocabulary_of(paths, recordings.labels)
    length = window or min(WINDOWS[1], max(WINDOWS[0], round(WINDOW_S * origin.rate_hz)))
    settings = recipe.settings(origin.rate_hz, length)
    if origin.unit != PICOFARAD:
        settings = replace(settings, normalise="difference", scale=_scale(recordings))
    found = _Found()
    sources = _sources(recordings, recipe, choice, vocabulary, found, say, every=every)
    try:
        examples = prepare(sources, settings)
    except ValueError as error:
        raise ValueError(_nothing(found, len(recordings), str(error))) from None
    return Data(
        examples,
        tuple(found.rows),
        _join(found.session, found.copies.shared()),
        _join(found.user, found.copies.shared()),
        vocabulary,
        settings,
        origin.pitch_mm,
        origin.unit,
        digest(survey.path for survey in recordings.surveys),
        tuple(found.notes),
    )


def _sources(
    recordings: Recordings,
    recipe: Recipe,
    choice: Choice,
    vocabulary: Vocabulary,
    found: _Found,
    say: Say,
    *,
    every: bool,
) -> Iterator[Source]:
    """Yield each recording as it is learned from, and note what is known about it."""
    for number, survey in enumerate(recordings.surveys):
        recording = recordings[number]
        report = check.examine(survey.path, recording)
        labeller = _labeller(recording, choice, recipe)
        if labeller is None:
            found.notes.append(f"{survey.path} is left out: {_unlabelled(recording, choice)}")
            continue
        if why := _failed(report, recording):
            done = "taken although it failed the check" if every else "left out"
            found.notes.append(f"{survey.path} is {done}: {why}")
            if not every:
                continue
        lateness = None
        if labeller != "true":
            repaired, lateness = label_repair.repair(recording, labeller)
            labels = repaired if recipe.repair else getattr(recording, COLUMNS[labeller])
            if choice == "auto" and recipe.truth:  # the truth is better where it is known
                labels = np.where(recording.label != UNKNOWN, recording.label, labels)
            recording = label_repair.with_labels(recording, labeller, labels)
            if (labels == UNKNOWN).all():
                found.notes.append(f"{survey.path} is left out: {_vanished(lateness, labeller)}")
                continue
        source = Source.of(recording, labeller, vocabulary.labels)
        source = replace(source, touch=true_places(recording, source.label, vocabulary))
        origin = recording.origin
        found.rows.append(
            SessionRow(
                str(survey.path),
                origin.user,
                origin.session,
                survey.seconds,
                report.level.name.lower(),
                tuple(finding.text for finding in report.findings),
                labeller,
                held_out=False,
                examples=label_repair.examples(source.label, vocabulary.labels),
                lateness=lateness,
            )
        )
        user = f"{origin.seed} {origin.user}" if origin.user else str(survey.path)
        found.user.append(user)
        found.session.append(f"{user} {origin.session}" if origin.session else str(survey.path))
        found.copies.add(recording)
        if (number + 1) % 20 == 0:
            say(f"read {number + 1} of {len(recordings)} recordings")
        yield source


def fingerprint(digest: str, vocabulary: Vocabulary) -> str:
    """Return a hash of all that a training learns from: recordings, and what is known of them.

    Args:
        digest: SHA-256 over the recordings.
        vocabulary: Their gestures; where the files of gestures lie does not count.
    """
    entries = [replace(entry, file=None) for entry in vocabulary.entries]
    return hashlib.sha256(f"{digest} {entries!r}".encode()).hexdigest()


def vocabulary_of(paths: Iterable[Path], labels: tuple[str, ...]) -> Vocabulary:
    """Return what lies beside the recordings, or what is known of their labels.

    Raises:
        ValueError: It is of other gestures, or there are several that differ.
    """
    folders = [path if path.is_dir() else path.parent for path in paths]
    files = [folder / FILE for folder in folders if os.path.lexists(folder / FILE)]
    if not files:
        return vocabularies.of(labels)
    vocabulary = vocabularies.read(files[0])
    if vocabulary.labels != labels:
        raise ValueError(
            f"{files[0]} names {', '.join(vocabulary.labels)}, the recordings "
            f"{', '.join(labels)}; lay the file beside its own recordings"
        )
    for other in files[1:]:
        if vocabularies.read(other).entries != vocabulary.entries:
            raise ValueError(f"{files[0]} and {other} differ; train on one vocabulary")
    return vocabulary


def _labeller(recording: Recording, choice: Choice, recipe: Recipe) -> Labels | None:
    """Return which labels are learned; None if none of them names a gesture."""
    listed: tuple[Labels, ...] = ("button", "key", "cue", "true")
    if choice != "auto":
        listed = (choice,)
    elif recipe.truth and (recording.label != UNKNOWN).mean() > KNOWN:
        listed = ("true",)
    named = [name for name in listed if (getattr(recording, COLUMNS[name]) > 0).any()]
    return named[0] if named else None


def _nothing(found: _Found, recordings: int, error: str) -> str:
    """Return why there is nothing to learn from, with the first recordings that are left out."""
    if not found.rows:
        error = f"nothing can be learned from {count(recordings, 'recording')}"
    more = len(found.notes) - SAID
    rest = [f"and {more} more"] if more > 0 else []
    return "; ".join([error, *found.notes[:SAID], *rest])


def _unlabelled(recording: Recording, choice: Choice) -> str:
    """Return why no labels of a recording can be learned."""
    labels = [n for n, column in COLUMNS.items() if (getattr(recording, column) > 0).any()]
    other = f"; it has {' and '.join(labels)} labels" if labels else ""
    return f"no {'' if choice == 'auto' else choice + ' '}label names a gesture{other}"


def _failed(report: check.Report, recording: Recording) -> str:
    """Return why a recording should not be learned from; "": it may."""
    off = recording.rate_hz / recording.origin.rate_hz - 1.0
    if abs(off) > RATE_TOLERANCE:
        return (
            f"it runs at {recording.rate_hz:.2f} Hz, more than 2 % off the "
            f"{recording.origin.rate_hz:g} Hz that it was meant for"
        )
    return next((f.text for f in report.findings if f.level is check.Level.FAILED), "")


def _vanished(lateness: Lateness, labeller: Labels) -> str:
    """Return why nothing is left of a recording's labels after their repair."""
    if lateness.unfelt:
        return f"the sensor felt no touch where its {labeller} labels are"
    return f"its {labeller} labels are too short: every frame is near an edge of one"


def _scale(recordings: Recordings) -> float:
    """Return what makes a firm touch as strong as the orb's, in the frames' unit."""
    firm = []
    for number in range(min(SAMPLED, len(recordings))):
        recording = recordings[number]
        response = respond(recording)
        named = (
            np.any([getattr(recording, column) > 0 for column in COLUMNS.values()], axis=0)
            & response.known
        )
        energy = response.energy[named if named.any() else response.touched]
        if len(energy):
            firm.append(float(np.quantile(energy, 0.75)))
    usual = float(np.median(firm)) if firm else 0.0
    if not usual > 0.0:
        raise ValueError("nothing is felt in these recordings; check the sensor")
    return float(f"{usual / FIRM:.3g}")


def _join(groups: Sequence[str], shared: dict[int, dict[int, int]]) -> NDArray[np.int64]:
    """Return the group of each recording, (recordings,); those that share frames are of one."""
    first = {group: number for number, group in reversed(list(enumerate(groups)))}
    root = np.array([first[group] for group in groups], dtype=np.int64)
    for one, others in shared.items():
        for other in others:
            low, high = sorted((root[one], root[other]))
            root[root == high] = low
    return root
