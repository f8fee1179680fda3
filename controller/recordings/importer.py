"""Import arrays of other sensors, by a description in TOML: a recording a user and session."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from controller.recognition.images.drift import tone
from controller.recognition.images.scale import SIGNS
from controller.recordings import tables
from controller.recordings.description import ALONE, TIME_UNITS, Description
from controller.recordings.recording import (
    PICOFARAD,
    UNKNOWN,
    Mark,
    Provenance,
    Recording,
    RecordingError,
    mean_rate,
    software,
    unlabelled,
)
from controller.recordings.writer import check_names
from controller.shared import npz
from controller.shared.cues import NULL_LABEL
from controller.shared.errors import reason
from controller.shared.npz import Arrays

MAX_BYTES: Final = 1 << 30  # of a file of arrays and of what it unpacks to
SAMPLED: Final = 2_000  # frames from which the sign is found out
_POSSIBLE_HZ: Final = (1.0, 10_000.0)  # frames per second; beyond, times are in another unit
_USUAL_HZ: Final = (5.0, 500.0)
_NEGATIVE_SHARE: Final = 0.25  # of readings in pF, that may be 0 or below: leads are off
_DIGITS: Final = 2  # of a user's or session's number


def read(path: Path, description: Description) -> Arrays:
    """Return the described arrays in an .npz, .npy or .csv; RecordingError if one is unfit."""
    if path.suffix == ".csv":
        return tables.read(path, description)
    try:
        if path.suffix == ".npy":
            arrays = {description.frames: npz.single(path, MAX_BYTES)}
        else:
            arrays = npz.unpack(path, MAX_BYTES, only=description.arrays)
    except OSError as error:
        raise RecordingError(f"cannot read {path}: {reason(error)}") from None
    except ValueError as error:
        raise RecordingError(f"{path} {error}; name an .npz or .npy of plain numbers") from None
    optional = {f"{name}_names" for name in (description.subject, *description.session)}
    for name in sorted(description.arrays - optional):
        if name not in arrays:
            raise RecordingError(f"{path} has no array {name!r}, which the description names")
    return arrays


def recordings(arrays: Arrays, description: Description) -> Iterator[Recording]:
    """Yield a recording of each user and session; RecordingError if arrays are not as described."""
    frames = _frames(arrays, description)
    count = len(frames)
    times = _times(arrays, description, count)
    labels, column = _labels(arrays, description, count)
    rest, marks = _rest(arrays, description, frames), _marks(arrays, description, labels, column)
    sign = SIGNS[description.sign or "falls"]
    if not description.sign:
        sign = _sign(frames, column == 0, None if description.rest == description.frames else rest)
    groups = list(_groups(arrays, description, count))
    rate_hz = description.rate_hz
    if times is not None and (len(times) > 1 or not rate_hz):
        measured_hz = _rate(times, [rows for _, _, rows in groups], description)
        rate_hz = rate_hz or measured_hz
    for user, session, chosen in groups:
        check_names(user, session)
        rows, t, sequence = _stretches(chosen, times, rate_hz, description)
        with np.errstate(over="ignore"):  # what is no number is refused later, in a sentence
            taken = frames[rows].astype(np.float32)
        own_rest = taken[0] if description.rest == description.frames else rest
        given: dict[str, Any] = {**unlabelled(len(rows)), description.labeller: column[rows]}
        origin = Provenance(
            device_id=description.device,
            rows=taken.shape[1],
            columns=taken.shape[2],
            pitch_mm=description.pitch_mm,
            rate_hz=rate_hz,
            labels=labels,
            bundle="",
            engine="",
            software=software(),
            user=user,
            session=session,
            protocol=description.protocol,
            hardware=description.hardware,
            unit=description.unit,
            sign=sign,
            id=_id(description, user, session, (taken, t, sequence, column[rows]), own_rest),
        )
        yield Recording(
            origin,
            taken,
            t=t,
            sequence=sequence,
            excluded=np.zeros(len(rows), dtype=np.bool_),
            touch=np.full((len(rows), 2), np.nan),
            rest=own_rest,
            marks=tuple(
                Mark(float(at), *text)
                for at, row in zip(t, rows.tolist(), strict=True)
                for text in marks.get(row, ())
            ),
            **given,
        )


def _frames(arrays: Arrays, description: Description) -> NDArray[Any]:
    """Return the frames, (n, rows, columns), of any numeric type."""
    frames = arrays[description.frames]
    if description.rows and description.columns and frames.ndim in (2, 3):
        if frames[:1].size not in (0, description.rows * description.columns):
            raise RecordingError(
                f"the array {description.frames!r} has {frames[:1].size} taxels, "
                f"not {description.rows} x {description.columns}"
            )
        frames = frames.reshape(len(frames), description.rows, description.columns)
    if frames.ndim != 3 or not frames.size or frames.dtype.kind not in "iuf":
        raise RecordingError(
            f"the array {description.frames!r} is {frames.dtype} {frames.shape}, not numbers of "
            "(n, rows, columns); give rows and columns if it is flat"
        )
    if description.unit == PICOFARAD and (share := float((frames <= 0).mean())) > _NEGATIVE_SHARE:
        raise RecordingError(
            f"of the readings in {description.frames!r} {share:.0%} are 0 or below, and "
            f"{PICOFARAD} are divided by the untouched sensor's; give another unit, such as counts"
        )
    return frames


def _column(arrays: Arrays, name: str, count: int, kinds: str = "iuf") -> NDArray[Any]:
    """Return an array with one value for each frame, (count,)."""
    array = arrays[name]
    if array.shape in ((), (1,)):  # one for all frames
        array = np.repeat(array.reshape(1), count)
    if array.shape != (count,) or array.dtype.kind not in kinds:
        raise RecordingError(
            f"the array {name!r} is {array.dtype} {array.shape}, not one "
            f"{'number' if 'f' in kinds else 'whole number'} for each of the {count} frames"
        )
    return array


def _times(arrays: Arrays, description: Description, count: int) -> NDArray[np.float64] | None:
    """Return the time of each frame, (n,) seconds; None if there are none."""
    if not description.time:
        return None
    times = _column(arrays, description.time, count).astype(np.float64)
    if not np.isfinite(times).all():
        raise RecordingError(f"the array {description.time!r} has times that are no numbers")
    return times * TIME_UNITS[description.time_unit]


def _labels(
    arrays: Arrays, description: Description, count: int
) -> tuple[tuple[str, ...], NDArray[np.int16]]:
    """Return the labels, "null" first, and the index of each frame's, (count,)."""
    if not description.label:
        return (NULL_LABEL,), np.full(count, UNKNOWN, dtype=np.int16)
    given = description.label_names
    if isinstance(given, str):
        if arrays[given].dtype.kind != "U" or arrays[given].ndim != 1:
            raise RecordingError(f"the array {given!r} is no list of names")
        given = tuple(arrays[given].tolist())
    number = _column(arrays, description.label, count, "iu").astype(np.int64)
    if description.null and description.null not in given:
        raise RecordingError(
            f"null = {description.null!r} is none of the labels {', '.join(given)}"
        )
    unfit = (number < UNKNOWN) | (number >= len(given))
    if unfit.any():
        raise RecordingError(
            f"the array {description.label!r} holds {number[unfit][0]}, and there are "
            f"{len(given)} labels, counted from 0 ({UNKNOWN}: unknown)"
        )
    null = description.null or (NULL_LABEL if NULL_LABEL in given else "")
    # Names that no frame has are left out of training.
    used = [i for i in np.unique(number[number >= 0]).tolist() if given[i] != null]
    labels = (NULL_LABEL, *(given[i] for i in used))
    odd = next(
        (label for label in labels if not label[:1].isalnum() or set(label) & set("/\\")), ""
    )
    if odd or "" in labels:
        raise RecordingError(f"the label {odd!r} is no name of a gesture; give label_names")
    if len(set(labels)) < len(labels):
        raise RecordingError(f"the labels {', '.join(labels)} are not all different")
    index = np.zeros(len(given) + 1, dtype=np.int16)
    index[used] = np.arange(1, len(used) + 1)
    index[UNKNOWN] = UNKNOWN  # the last element, which -1 selects
    return labels, index[number]


def _rest(
    arrays: Arrays, description: Description, frames: NDArray[Any]
) -> NDArray[np.float32] | None:
    """Return the untouched sensor, (rows, columns); None if it is unknown."""
    if not description.rest:
        return None
    given, shape = arrays[description.rest], frames.shape[1:]
    if given.dtype.kind not in "iuf" or given.size % max(1, frames[0].size) or not given.size:
        raise RecordingError(
            f"the array {description.rest!r} is {given.dtype} {given.shape}, not a frame of {shape}"
        )
    first: NDArray[np.float32] = given.reshape(-1, *shape)[0].astype(np.float32)
    if not np.isfinite(first).all():
        raise RecordingError(f"the array {description.rest!r} has readings that are no numbers")
    return first


@np.errstate(invalid="ignore")
def _sign(frames: NDArray[Any], null: NDArray[np.bool_], rest: NDArray[np.float32] | None) -> int:
    """Return 1 if touches raise frames, (n, rows, columns), -1 if they lower them.

    The level at rest is `rest`, the median of frames labelled "null", (n,), or that of all. A touch
    on few taxels is seen among them, one on a noisy sensor in their means.
    """
    chosen = np.unique(np.linspace(0, len(frames) - 1, SAMPLED).astype(np.int64))
    taken, null = frames[chosen].astype(np.float64), null[chosen]
    level = np.median(taken[null] if null.any() else taken, axis=0) if rest is None else rest
    change = taken - level
    tones = tone(change), tone(change.mean(axis=(1, 2)))
    return SIGNS["rises"] if max(tones, key=abs) > 0.0 else SIGNS["falls"]


def _marks(
    arrays: Arrays, description: Description, labels: Sequence[str], column: NDArray[np.int16]
) -> dict[int, list[tuple[str, str]]]:
    """Return the kinds and texts of the marks at each frame that has one, by its index.

    Places are cues, as `teach` records them; `column` is the label of each frame, (n,).
    """
    found: dict[int, list[tuple[str, str]]] = {}
    if description.place:
        place = arrays[description.place]
        if place.shape != (len(column), 2) or place.dtype.kind not in "iuf":
            raise RecordingError(
                f"the array {description.place!r} is {place.dtype} {place.shape}, not x and y for "
                f"each of the {len(column)} frames"
            )
        known = np.flatnonzero(np.isfinite(place).all(axis=1) & (column > 0))
        asked = np.column_stack([place[known], column[known]])
        new = (np.diff(asked, axis=0, prepend=np.nan) != 0.0).any(axis=1)
        for row, (x, y, label) in zip(known[new].tolist(), asked[new].tolist(), strict=True):
            found[row] = [("cue", f"go {labels[int(label)]} at {x:.3f},{y:.3f}")]
    if description.marks:
        texts = _column(arrays, description.marks, len(column), "U")
        for row in np.flatnonzero((texts != np.roll(texts, 1)) | (np.arange(len(texts)) == 0)):
            if text := str(texts[row]):
                found.setdefault(int(row), []).append(("note", text))
    return found


def _rate(
    times: NDArray[np.float64], groups: Sequence[NDArray[np.int64]], description: Description
) -> float:
    """Return the frames per second: frames over time in stretches of times, (n,), three digits.

    RecordingError if times do not rise, or cannot be in their unit.
    """
    steps = np.concatenate([np.diff(times[rows]) for rows in groups])
    steps = steps[(steps > 0.0) if description.drop_repeated else (steps >= 0.0)]
    if description.gap_s and (steps <= description.gap_s).any():
        steps = steps[steps <= description.gap_s]
    if not (steps > 0.0).any():
        raise RecordingError("the times do not rise, so the rate is unknown; give rate_hz")
    rate_hz = float(f"{mean_rate(steps):.3g}")
    if not _POSSIBLE_HZ[0] <= rate_hz <= _POSSIBLE_HZ[1]:
        fits = [
            unit
            for unit, scale in TIME_UNITS.items()
            if _USUAL_HZ[0] <= rate_hz * TIME_UNITS[description.time_unit] / scale <= _USUAL_HZ[1]
        ]
        likely = " or ".join(f'time_unit = "{unit}"' for unit in fits) or "its true time_unit"
        raise RecordingError(
            f"the array {description.time!r} has {rate_hz:g} frames a second if it is in "
            f"{description.time_unit}; expected are {_POSSIBLE_HZ[0]:g} to {_POSSIBLE_HZ[1]:g}; "
            f"say {likely}"
        )
    return rate_hz


def _groups(
    arrays: Arrays, description: Description, count: int
) -> Iterator[tuple[str, str, NDArray[np.int64]]]:
    """Yield (user, session, indices of frames) of each user and session, in order."""
    names = [name for name in (description.subject, *description.session) if name]
    columns = [_column(arrays, name, count, "iuU") for name in names]
    if not columns:
        yield description.user, ALONE, np.arange(count)
        return
    codes = [np.unique(column, return_inverse=True) for column in columns]
    _, group = np.unique(np.stack([code for _, code in codes], axis=1), axis=0, return_inverse=True)
    group = group.reshape(count)
    order = np.argsort(group, kind="stable")  # frames stay in order
    edges = np.flatnonzero(np.diff(group[order])) + 1
    for chosen in np.split(order, edges):
        words = [
            _word(arrays, name, column[chosen[0]])
            for name, column in zip(names, columns, strict=True)
        ]
        user = words.pop(0) if description.subject else description.user
        yield user, "".join(words) or ALONE, chosen


def _word(arrays: Arrays, name: str, value: Any) -> str:
    """Return the ID of a user or a session: letters and digits."""
    named = arrays.get(f"{name}_names")
    if isinstance(value, np.integer):
        if named is not None and named.dtype.kind == "U" and 0 <= value < len(named):
            value = named[int(value)]
        else:
            return f"{int(value):0{_DIGITS}d}"
    return str(value)


def _stretches(
    chosen: NDArray[np.int64],
    times: NDArray[np.float64] | None,
    rate_hz: float,
    description: Description,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Return frames to keep, rising times, and numbers with a gap after each pause, each (n,)."""
    if times is None:
        number = np.arange(1, len(chosen) + 1)
        return chosen, number / rate_hz, number
    own = times[chosen]
    new = np.diff(own, prepend=-np.inf) != 0.0
    if description.drop_repeated:
        chosen, own = chosen[new], own[new]
    elif not (new.all() or description.even_times):
        raise RecordingError(
            f"the array {description.time!r} has the time {own[~new][0]:g} twice in a row; say "
            "drop_repeated = true to keep the first frame of each time, or even_times = true"
        )
    step = np.diff(own, prepend=own[0])
    back = step < 0.0
    pause_s = max(description.gap_s, 2.0 / rate_hz)
    begins = back | ((step > description.gap_s) if description.gap_s else back)
    step[back] = pause_s
    if description.even_times:
        step[~begins] = 1.0 / rate_hz
        step[begins] = np.maximum(step[begins], pause_s)
    return chosen, np.cumsum(step) - step[0], np.cumsum(1 + begins.astype(np.int64))


def _id(
    description: Description,
    user: str,
    session: str,
    arrays: Sequence[NDArray[Any]],
    rest: NDArray[np.float32] | None,
) -> str:
    """Return a hash of the arrays, of which frames, (n, rows, columns), are the first, as id."""
    digest = hashlib.blake2b(digest_size=16)
    known = asdict(description)
    for key, usual in (("sign", ""), ("time_unit", "s")):  # ids are those of before there were any
        if known[key] == usual:
            del known[key]
    context = [known, user, session, arrays[0].shape]
    digest.update(json.dumps(context).encode())
    for array in (*arrays, *([] if rest is None else [rest])):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
