"""Load folders of recordings as examples: check each, choose its labels, find its group."""

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles import vocabulary as vocabularies
from controller.bundles.vocabulary import FILE, Vocabulary
from controller.recognition.images.frames import MOST_WINDOW, PreprocessSettings, same_rate
from controller.recognition.images.scale import FIRM
from controller.recordings.quality import check
from controller.recordings.quality.check import FrameIndex
from controller.recordings.quality.taxels import respond
from controller.recordings.reader import Survey
from controller.recordings.recording import UNKNOWN, Provenance, Recording, RecordingError
from controller.shared.aliases import Say
from controller.shared.errors import count
from models.data import label_repair
from models.data.examples import (
    PEOPLE_SOURCES,
    SAID,
    SOURCES,
    Choice,
    Column,
    Examples,
    Labels,
    Recordings,
    Source,
    column,
    digest,
    labellers,
    prepare,
    read_training,
)
from models.data.ground_truth import true_places
from models.data.recipe import Recipe
from models.results.training import Lateness, SessionRow

WINDOW_S: Final = 1.0  # paper, section 5: a buffer of one second
LEAST_WINDOW: Final = 4  # images of a default window
ORB: Final = (5, 5)  # rows and columns of the paper's orb
# Greatest relative difference of rates. People differ more in tempo: simulated ones are understood
# as well at rates 8 % below and above theirs (docs/measurements.md).
RATES: Final = 0.08
KNOWN: Final = 0.5  # share of frames from which on the truth counts as known
SAMPLED: Final = 8  # recordings from which a scale is taken
WINDOWLESS: Final = "it has no quiet second, or no whole labelled window after it"


@dataclass(frozen=True, slots=True)
class Data:
    """Examples of a data set, with the facts on its recordings."""

    examples: Examples  # of all sessions; `examples.session` counts `rows`
    rows: tuple[SessionRow, ...]  # facts on each recording, held out or not
    session: NDArray[np.int64]  # group of each recording: parts of one session are one
    user: NDArray[np.int64]  # group of each recording: those of one user are one
    vocabulary: Vocabulary  # its gestures
    settings: PreprocessSettings  # preprocessing settings
    pitch_mm: float  # of the sensor
    unit: str  # of the frames
    digest: str  # SHA-256 over all files, in order
    notes: tuple[str, ...] = ()  # recordings left out, in sentences


def read(
    paths: Sequence[Path],
    recipe: Recipe,
    choice: Choice,
    say: Say,
    *,
    window: int = 0,
    every: bool = False,
) -> Data:
    """Read data sets, and make examples of them; ValueError if there is nothing to learn from.

    A window of 0 images is that of a second; `every` takes recordings that fail the check.
    """
    recordings = read_training(paths)
    origin, rate_hz = recordings.surveys[0].origin, recordings.rate_hz
    vocabulary = vocabulary_of(paths, recordings.labels, orb=of_orb(origin))
    settings = settings_of(recordings, origin, rate_hz, recipe, window)
    reader = _Reader(recordings, recipe, choice, vocabulary, every, notes=list(recordings.notes))
    try:
        examples = prepare(reader.sources(say), settings)
    except ValueError as error:
        raise ValueError(reader.nothing(str(error))) from None
    with_window = np.isin(np.arange(len(reader.rows)), examples.session[examples.ends])
    for row, used in zip(reader.rows, with_window, strict=True):
        if not used:
            reader.notes.append(f"{row.path} is not learned from: {WINDOWLESS}")
    shared = reader.copies.shared()
    return Data(
        examples,
        tuple(reader.rows),
        join(reader.session, shared),
        join(reader.user, shared),
        vocabulary,
        settings,
        origin.pitch_mm,
        origin.unit,
        digest(survey.path for survey in recordings.surveys),
        tuple(reader.notes),
    )


def settings_of(
    recordings: Recordings | Sequence[Recording],
    origin: Provenance,
    rate_hz: float,
    recipe: Recipe,
    window: int = 0,
) -> PreprocessSettings:
    """Return the preprocessing for recordings of one kind, with the scale of their touches.

    A window of 0 images is that of a second. ValueError if no touch is felt where one is needed.
    """
    length = window or min(MOST_WINDOW, max(LEAST_WINDOW, round(WINDOW_S * rate_hz)))
    settings = recipe.settings(rate_hz, length)
    if origin.signal.ratio:
        return settings
    return replace(settings, normalise="difference", scale=_scale(recordings))


class _LeftOutError(ValueError):
    """A recording is not learned from; the message is the reason."""


class _UnfeltError(_LeftOutError):
    """No label of a recording has a touch."""


@dataclass(slots=True)
class _Reader:
    """Reads recordings as training uses them, and collects the facts on them."""

    recordings: Recordings
    recipe: Recipe
    choice: Choice
    vocabulary: Vocabulary
    every: bool
    rows: list[SessionRow] = field(default_factory=list)
    session: list[str] = field(default_factory=list)
    user: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    copies: FrameIndex = field(default_factory=FrameIndex)

    def sources(self, say: Say) -> Iterator[Source]:
        """Yield each recording as training uses it; the others are noted with the reason."""
        unfelt: list[tuple[int, str]] = []
        for number, survey in enumerate(self.recordings.surveys, 1):
            try:
                source = self._source(survey, self.recordings[number - 1])
            except _UnfeltError as why:
                unfelt.append((number - 1, str(why)))
                continue
            except (_LeftOutError, RecordingError) as why:
                self.notes.append(f"{survey.path} is left out: {why}")
                continue
            if number % 20 == 0:
                say(f"read {number} of {len(self.recordings)} recordings")
            yield source
        repairable = bool(self.rows)
        for number, reason in unfelt:
            survey = self.recordings.surveys[number]
            if repairable:
                self.notes.append(f"{survey.path} is left out: {reason}")
            else:
                self.notes.append(f"{survey.path} is used with its labels as given: {reason}")
                yield self._source(survey, self.recordings[number], as_given=True)
        self._note_repair()

    def _note_repair(self) -> None:
        """Note how much of the labels their repair has changed."""
        late = [row.lateness for row in self.rows if row.lateness is not None]
        if self.recipe.repair and (named := sum(one.named for one in late)):
            share = 100.0 * sum(one.changed for one in late) / named
            self.notes.append(
                f"label repair changed {share:.1f} % of the frames that people named a gesture"
            )

    def nothing(self, error: str) -> str:
        """Return why there is nothing to learn from, with the first recordings left out."""
        if not self.rows:
            error = f"nothing can be learned from {count(len(self.recordings), 'recording')}"
        more = len(self.notes) - SAID
        rest = [f"and {more} more"] if more > 0 else []
        return "; ".join([error, *self.notes[:SAID], *rest])

    def _source(self, survey: Survey, recording: Recording, *, as_given: bool = False) -> Source:
        """Return a recording as training uses it, and note the facts on it; or _LeftOutError."""
        report = check.examine(survey.path, recording)
        labeller = self._labeller(recording)
        if why := _failed(report, recording, self.recordings.rate_hz):
            if not self.every:
                raise _LeftOutError(f"{why} (--all takes it; in a sweep: all = true)")
            self.notes.append(f"{survey.path} is taken although it failed the check: {why}")
        labels, lateness = self._labels(recording, labeller, as_given=as_given)
        source = Source.of(recording, labeller, self.vocabulary.labels, labels)
        source = replace(source, touch=true_places(recording, source.label, self.vocabulary))
        origin = recording.origin
        self.rows.append(
            SessionRow(
                str(survey.path),
                origin.user,
                origin.session,
                survey.seconds,
                report.level.name.lower(),
                tuple(finding.text for finding in report.findings),
                labeller,
                held_out=False,
                examples=label_repair.examples(source.label, self.vocabulary.labels),
                lateness=lateness,
            )
        )
        user = f"{origin.seed} {origin.user}" if origin.user else str(survey.path)
        self.user.append(user)
        self.session.append(f"{user} {origin.session}" if origin.session else str(survey.path))
        self.copies.add(recording)
        return source

    def _labeller(self, recording: Recording) -> Labels:
        """Return the source of the labels; _LeftOutError if none of them names a gesture."""
        listed: tuple[Labels, ...] = (*PEOPLE_SOURCES, "true")
        if self.choice != "auto":
            listed = (self.choice,)
        elif self.recipe.truth and (recording.label != UNKNOWN).mean() > KNOWN:
            listed = ("true",)
        if named := labellers(recording, listed):
            return named[0]
        others = labellers(recording)
        kind = "" if self.choice == "auto" else f"{self.choice} "
        other = f"; it has {' and '.join(others)} labels" if others else ""
        raise _LeftOutError(f"no {kind}label names a gesture{other}")

    def _labels(
        self, recording: Recording, labeller: Labels, *, as_given: bool
    ) -> tuple[Column, Lateness | None]:
        """Return the labels to learn, (frames,), and the lateness of those that people gave."""
        labels = column(recording, labeller)
        if labeller == "true":
            return labels, None
        repaired, lateness = label_repair.repair(recording, labeller)
        unfelt = self.recipe.repair and not lateness.edges and not as_given
        if self.recipe.repair:
            labels = repaired
        if self.choice == "auto" and self.recipe.truth:  # the truth is better where it is known
            labels = np.where(recording.label != UNKNOWN, recording.label, labels)
            unfelt = unfelt and bool((recording.label == UNKNOWN).all())
        if unfelt:
            raise _UnfeltError(f"the sensor shows no touch where its {labeller} labels are")
        if (labels != UNKNOWN).any():
            return labels, lateness
        raise _LeftOutError(f"its {labeller} labels are too short: all frames are near an edge")


def fingerprint(digest: str, vocabulary: Vocabulary) -> str:
    """Return a hash of all data of a training: the recordings' SHA-256, and their gestures."""
    entries = [replace(entry, file=None) for entry in vocabulary.entries]
    return hashlib.sha256(f"{digest} {entries!r}".encode()).hexdigest()


def of_orb(origin: Provenance) -> bool:
    """Return whether they are of an orb, real or simulated, whose gestures are known by name."""
    known = "orb" in origin.hardware or (origin.rows, origin.columns) == ORB
    return origin.signal.ratio and (bool(origin.preset) or known)


def vocabulary_of(
    paths: Iterable[Path], labels: tuple[str, ...], *, orb: bool = True
) -> Vocabulary:
    """Return the vocabulary beside the recordings, or the shipped entries of their labels.

    The symmetries of shipped entries are for the orb only.
    """
    folders = [path if path.is_dir() else path.parent for path in paths]
    files = [folder / FILE for folder in folders if os.path.lexists(folder / FILE)]
    if not files:
        return vocabularies.of(labels, orb=orb)
    vocabulary = vocabularies.read(files[0])
    if sorted(vocabulary.labels) != sorted(labels):
        raise ValueError(
            f"{files[0]} names {', '.join(vocabulary.labels)}, the recordings "
            f"{', '.join(labels)}; lay the file beside its own recordings"
        )
    for other in files[1:]:
        if vocabularies.read(other).entries != vocabulary.entries:
            raise ValueError(f"{files[0]} and {other} differ; train on one vocabulary")
    return vocabulary


def _failed(report: check.Report, recording: Recording, usual_hz: float) -> str:
    """Return why a recording should not be learned from; "": it may."""
    if not same_rate(recording.origin.rate_hz, usual_hz, RATES):
        return f"it is meant for {recording.origin.rate_hz:g} Hz, others for {usual_hz:g} Hz"
    if not same_rate(recording.rate_hz, recording.origin.rate_hz, RATES):
        return (
            f"it runs at {recording.rate_hz:.2f} Hz, more than {100 * RATES:.0f} % off the "
            f"{recording.origin.rate_hz:g} Hz that it was meant for"
        )
    return next((f.text for f in report.findings if f.level is check.Level.FAILED), "")


def _scale(recordings: Recordings | Sequence[Recording]) -> float:
    """Return the scale that makes a firm touch as strong as the orb's, in the frames' unit."""
    firm = []
    for number in range(min(SAMPLED, len(recordings))):
        try:
            recording = recordings[number]
        except RecordingError:  # noted when it is read
            continue
        response = respond(recording)
        named = np.any([column(recording, name) > 0 for name in SOURCES], axis=0) & response.known
        energy = response.energy[named if named.any() else response.touched]
        if len(energy):
            firm.append(float(np.quantile(energy, 0.75)))
    usual = float(np.median(firm)) if firm else 0.0
    if not usual > 0.0:
        raise ValueError("these recordings show no response to touches; check the sensor")
    return float(f"{usual / FIRM:.3g}")


def join(groups: Sequence[str], shared: dict[int, dict[int, int]]) -> NDArray[np.int64]:
    """Return the group of each recording, (recordings,); those that share frames are of one."""
    first = {group: number for number, group in reversed(list(enumerate(groups)))}
    root = np.array([first[group] for group in groups], dtype=np.int64)
    for one, others in shared.items():
        for other in others:
            low, high = sorted((root[one], root[other]))
            root[root == high] = low
    return root
