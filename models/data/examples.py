"""Examples from sessions, through the preprocessing that runs on the device.

Recordings are surveyed first and loaded one at a time: a data set may be larger than memory.
"""

import hashlib
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.frames import MOST_WINDOW, PreprocessSettings
from controller.recognition.images.preprocess import Preprocessor
from controller.recordings import reader
from controller.recordings.reader import Survey
from controller.recordings.recording import UNKNOWN, Provenance, Recording, RecordingError
from controller.shared import files
from controller.shared.aliases import Mask
from controller.simulator.session import TEST_SEEDS

Labels = Literal["true", "button", "key", "cue"]  # the simulator's truth, or a labeller's
Choice = Literal["auto", "true", "button", "key", "cue"]
SOURCES: Final[tuple[Labels, ...]] = get_args(Labels)
PEOPLE_SOURCES: Final = SOURCES[1:]  # labels that people give
CHOICES: Final[tuple[Choice, ...]] = get_args(Choice)
WINDOWS: Final = (2, MOST_WINDOW)  # images in a window of a network to train
PITCHES: Final = 0.02  # greatest relative difference between the pitches of recordings
SAID: Final = 3  # recordings left out that an error names

Column = NDArray[np.int16]  # (frames,): class of each frame, -1 unknown


def run_starts(frame: NDArray[np.integer], *keys: NDArray[np.integer], gap: int = 0) -> Mask:
    """Return which entries begin a run, (n,): a key (n,) changes, or frames (n,) are far apart.

    `gap` is the most frames from one to the next in a run; 0: any number.
    """
    found = np.zeros(len(frame), dtype=np.bool_)
    found[:1] = True
    for key in keys:
        found[1:] |= np.diff(key) != 0
    if gap:
        found[1:] |= np.diff(frame) > gap
    return found


def column(recording: Recording, labels: Labels) -> Column:
    """Return the truth, or the labels of one labeller, (frames,)."""
    return np.asarray(getattr(recording, "label" if labels == "true" else labels))


def labellers(
    recording: Recording, among: Iterable[Labels] = SOURCES, least: int = 1
) -> list[Labels]:
    """Return the sources of labels that name a gesture; with `least` 0, a gesture or null."""
    return [name for name in among if (column(recording, name) >= least).any()]


def renumbered(label: NDArray[np.integer], own: Sequence[str], names: Sequence[str]) -> Column:
    """Return labels (frames,) by other names; classes that are not among them become unknown."""
    numbers = [*(names.index(name) if name in names else UNKNOWN for name in own), UNKNOWN]
    found: Column = np.array(numbers, dtype=np.int16)[label]  # -1, unknown, takes the last one
    return found


@dataclass(frozen=True, slots=True)
class Examples:
    """Images of several sessions in a row, and which windows may be cut from them."""

    images: NDArray[np.float32]  # z images, float32 (frames, rows, columns)
    label: NDArray[np.int64]  # class of each frame, -1 unknown, (frames,)
    touch: NDArray[np.float32]  # true position of a press, grid units, NaN elsewhere, (frames, 2)
    ends: NDArray[np.int64]  # last frame of every whole window whose class is known, (windows,)
    session: NDArray[np.int32]  # session number of each frame, (frames,)
    # mean of |z - 1| while nothing touched, as the device knew it then, (frames,)
    idle: NDArray[np.float32]
    window: int  # images in a window
    rate_hz: float = 10.0  # frames per second

    @classmethod
    def joined(cls, parts: "Sequence[Examples]") -> "Examples":
        """Return the frames of several; `ends` and `session` are those of the whole already."""
        names = [field.name for field in fields(cls) if field.name not in ("window", "rate_hz")]
        arrays = {n: np.concatenate([getattr(part, n) for part in parts]) for n in names}
        return cls(**arrays, window=parts[0].window, rate_hz=parts[0].rate_hz)

    def begins(self, ends: NDArray[np.int64], gap: int = 0) -> NDArray[np.bool_]:
        """Return which windows, by their last frames, begin a run of one class and session."""
        return run_starts(ends, self.label[ends], self.session[ends], gap=gap)

    def windows(self, ends: NDArray[np.int64]) -> NDArray[np.float32]:
        """Cut windows by their last frames, (windows, window, rows, columns), oldest first."""
        index = ends[:, None] + np.arange(1 - self.window, 1)
        return np.asarray(self.images[index])


@dataclass(frozen=True, slots=True)
class Source:
    """One recorded or simulated session, as training needs it."""

    frames: NDArray[np.float32]  # as they were read, (n, rows, columns)
    label: NDArray[np.integer]  # class of each frame, -1 unknown, (n,)
    touch: NDArray[np.float32]  # true position of a press, grid units, NaN elsewhere, (n, 2)
    sequence: NDArray[np.int64] | None = None  # number of each frame; None: none is missing, (n,)
    # frames that are not learned from; None: there are none, (n,)
    excluded: NDArray[np.bool_] | None = None

    @classmethod
    def of(
        cls,
        recorded: Recording,
        labels: Labels = "true",
        names: Sequence[str] = (),
        label: Column | None = None,
    ) -> "Source":
        """Return a recording as training needs it, by names of classes or its own labels.

        `label` (frames,) replaces the source's, such as repaired ones; ValueError if it is unknown.
        """
        label = column(recorded, labels) if label is None else label
        if (label == UNKNOWN).all():
            others = labellers(recorded, least=0)
            instead = f"learn from {' or '.join(others)} labels, or leave it out"
            raise ValueError(
                f"a recording of {recorded.origin.device_id} lacks {labels} labels; "
                f"{instead if others else 'label it first, or leave it out'}"
            )
        label = renumbered(label, recorded.origin.labels, names or recorded.origin.labels)
        nowhere = np.full((len(label), 2), np.nan, dtype=np.float32)
        touch = recorded.truth.touch if recorded.truth else nowhere
        return cls(recorded.frames, label, touch, recorded.sequence, recorded.excluded)


def refuse_test_seed(seed: int | None, what: str) -> None:
    """Raise ValueError if a seed of training or tuning is one for tests only."""
    if seed in TEST_SEEDS:
        raise ValueError(
            f"{what} has seed {seed}, and seeds {TEST_SEEDS.start} to {TEST_SEEDS.stop - 1} are "
            "for tests only; choose another"
        )


@dataclass(frozen=True, slots=True)
class Recordings:
    """Recordings of one kind, in files; each is loaded on access, and not kept."""

    surveys: tuple[Survey, ...]  # header of each
    notes: tuple[str, ...] = ()  # files left out, in sentences

    @property
    def labels(self) -> tuple[str, ...]:
        """All labels, "null" first: in order of the recording that has most, then of others."""
        given = sorted((survey.origin.labels for survey in self.surveys), key=len, reverse=True)
        return tuple(dict.fromkeys(label for labels in given for label in labels))

    @property
    def rate_hz(self) -> float:
        """The median of the intended rates."""
        rates = sorted(survey.origin.rate_hz for survey in self.surveys)
        return rates[len(rates) // 2]

    def __len__(self) -> int:
        return len(self.surveys)

    def __iter__(self) -> Iterator[Recording]:
        return (self[number] for number in range(len(self)))

    def __getitem__(self, number: int) -> Recording:
        """Load one; RecordingError if it cannot be read, or has changed since it was surveyed."""
        survey = self.surveys[number]
        loaded = reader.load(survey.path)
        if (loaded.origin, len(loaded.frames)) != (survey.origin, survey.frames):
            raise RecordingError(f"{survey.path} has changed meanwhile; begin again")
        return loaded


def recording_files(paths: Iterable[Path]) -> list[Path]:
    """Return recordings: files, and all in folders by name; ValueError if there are none."""
    named = list(paths)
    found = [
        file
        for path in named
        for file in (sorted(path.rglob("[!.]*.npz")) if path.is_dir() else [path])
    ]
    if not found:
        where = " or ".join(map(str, named))
        raise ValueError(
            f"there are no recordings in {where}; make some with: models simulate --out DIR"
        )
    return found


def recording_sets(
    paths: Iterable[Path], left_out: list[str] | None = None
) -> dict[str, list[Path]]:
    """Return the recordings of each folder by its name, and all single files as "recordings".

    A file that is named twice counts once. One that is no recording raises RecordingError, or is
    added to `left_out`, with the reason.
    """
    named = list(paths)
    folders = [path for path in named if path.is_dir()]
    names = [path.name or str(path) for path in folders]
    if len(set(names)) < len(names):  # two folders of one name
        names = [str(path) for path in folders]
    sets = {name: recording_files([path]) for name, path in zip(names, folders, strict=True)}
    if single := [path for path in named if not path.is_dir()]:
        sets["recordings"] = list({path.absolute(): path for path in single}.values())
    for name, found in sets.items():
        sets[name] = [file for file in found if _readable(file, left_out)]
    if not any(sets.values()):
        raise ValueError("; ".join(["no recording can be read", *(left_out or ())[:SAID]]))
    return {name: found for name, found in sets.items() if found}


def _readable(file: Path, left_out: list[str] | None) -> bool:
    """Return whether a file is a recording; see `recording_sets`."""
    try:
        reader.load(file) if left_out is not None else reader.survey(file)
    except RecordingError as error:
        if left_out is None:
            raise
        left_out.append(f"{file} is left out: {error}")
        return False
    return True


def digest(recordings: Iterable[Path]) -> str:
    """Return the SHA-256 over recordings, in order."""
    whole = hashlib.sha256()
    for path in recordings:
        whole.update(hashlib.sha256(files.read_bytes(path, reader.MAX_BYTES)).digest())
    return whole.hexdigest()


def read_training(paths: Iterable[Path]) -> Recordings:
    """Return recordings to train or tune on: files, and all in folders, in order of their names.

    One may know fewer labels than another, as where places only were recorded. A file that cannot
    be read, or is not of the kind of most, is left out with a note. ValueError if none is left, or
    one is for tests only.
    """
    surveys: list[Survey] = []
    notes: list[str] = []
    for file in recording_files(paths):
        try:
            surveys.append(reader.survey(file))
        except RecordingError as error:
            notes.append(f"{file} is left out: {error}")
            continue
        refuse_test_seed(surveys[-1].origin.seed, f"the recording {file}")
    if not surveys:
        raise ValueError("; ".join(["no recording can be read", *notes[:SAID]]))
    (usual, _), *_ = Counter(_kind(survey.origin) for survey in surveys).most_common()
    kept = []
    for survey in surveys:
        if (kind := _kind(survey.origin)) == usual:
            kept.append(survey)
        else:
            notes.append(f"{survey.path} is left out: it has {kind}, others {usual}")
    _one_pitch(kept)
    return Recordings(tuple(kept), tuple(notes))


def _one_pitch(surveys: Sequence[Survey]) -> None:
    """Raise ValueError if taxels are not equally far apart: places and shifts are in taxels."""
    first, *others = ((survey.origin.pitch_mm, survey.path) for survey in surveys)
    for other in others:
        if abs(other[0] / first[0] - 1.0) > PITCHES:
            text = "taxels are {:g} mm apart in {} and {:g} mm in {}; learn from one pitch only"
            raise ValueError(text.format(*first, *other))


def _kind(origin: Provenance) -> str:
    """Return what all recordings of a training have in common, in words."""
    return f"{origin.rows}×{origin.columns} taxels in {origin.unit}"


def prepare(sources: Iterable[Source], settings: PreprocessSettings) -> Examples:
    """Run every session through the device's preprocessing and join what is usable.

    Every frame goes through, as on the device; those before the rest image exists and those that
    are excluded are then left out. No window spans two sessions, a missing frame or an excluded
    one, and none ends at a frame whose class is unknown. ValueError if there is no window, or grids
    differ.
    """
    parts: list[Examples] = []
    frames = 0
    for number, source in enumerate(sources):
        stage = Preprocessor(settings, *source.frames.shape[1:])
        prepared = [stage.step(frame) for frame in source.frames]
        use, last = usable_windows([p.ready for p in prepared], source, settings.window)
        if not len(last):
            continue
        images = np.stack([prepared[i].image for i in use])
        if parts and images.shape[1:] != (grid := parts[0].images.shape[1:]):
            raise ValueError(
                f"sessions of {grid} and of {images.shape[1:]} taxels; train on one kind"
            )
        label = source.label[use].astype(np.int64)
        touch = source.touch[use].astype(np.float32)
        touch[label == UNKNOWN] = np.nan
        session = np.full(len(use), number, dtype=np.int32)
        idle = np.array([prepared[i].idle for i in use], dtype=np.float32)
        window = settings.window
        rate_hz = settings.rate_hz
        parts.append(Examples(images, label, touch, frames + last, session, idle, window, rate_hz))
        frames += len(use)
    if not parts:
        raise ValueError("no session has a quiet second and a whole labelled window; record more")
    return Examples.joined(parts)


def usable_windows(
    ready: list[bool], source: Source, window: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the frames kept, (kept,), and those of them that end a usable window, (windows,)."""
    usable = np.array(ready, dtype=np.bool_)
    if source.excluded is not None:
        usable &= ~source.excluded
    use = np.flatnonzero(usable)
    begins = run_starts(use, gap=1)  # a row of frames that lacks none
    if source.sequence is not None:
        begins |= run_starts(source.sequence[use], gap=1)
    place = np.arange(len(use))
    length = place - np.maximum.accumulate(np.where(begins, place, 0)) + 1
    last = np.flatnonzero((length >= window) & (source.label[use] != UNKNOWN))
    return use.astype(np.int64), last.astype(np.int64)
