"""Recordings made of arrays, tables and files that are not recordings yet."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from controller.recordings import importer
from controller.recordings.description import Description
from controller.recordings.recording import Recording as Source
from controller.shared import config
from controller.shared.cues import NULL_LABEL
from controller.shared.errors import UserError
from controller.shared.npz import Arrays
from orbtouch import checks

if TYPE_CHECKING:
    import pandas

Sign = Literal["falls", "rises", ""]
_TAXEL: Final = re.compile(r"r(\d+)c(\d+)")  # a column of a table
_MISSING: Final = dict.fromkeys(("None", "nan", "<NA>"), "")  # as text: labels that are unknown
_HZ: Final = 1.0, 10_000.0  # possible rates
_NEAR: Final = 1.5  # greatest ratio of the rate that is given and that of the times


def source(
    frames: object, t: object, rate_hz: float | None, labels: object, session: str, **facts: Any
) -> Source:
    """Return arrays as a recording; see `Recording.from_arrays`."""
    checks.one_of(facts["sign"], "sign", get_args(Sign))
    arrays = {"frames": _array(frames, "frames", "iuf", (-1, -1, -1))}
    count = len(arrays["frames"])
    with np.errstate(over="ignore"):
        finite = np.isfinite(arrays["frames"].astype(np.float32)).all(axis=(1, 2))
    if not finite.all():
        raise UserError(
            f"frame {finite.argmin()} has a reading that is no number (NaN, or above 3e38); fill "
            "it, or leave the frame out"
        )
    if rate_hz is None and (t is None or count == 1):
        raise UserError("the rate is unknown; give t, the seconds of each frame, or rate_hz")
    if rate_hz is not None:
        checks.number(rate_hz, "rate_hz", *_HZ)
        facts["rate_hz"] = float(rate_hz)
    if t is not None:
        arrays["t"], facts["time"] = _array(t, "t", "iuf", (count,)), "t"
        steps = np.diff(arrays["t"].astype(np.float64))
        rises = steps > 0.0  # NaN does not, either
        if not rises.all():
            i = int(rises.argmin())
            raise UserError(
                f"t does not rise from frame {i} to {i + 1} ({arrays['t'][i]:g} s, "
                f"{arrays['t'][i + 1]:g} s); sort the frames, and leave repeated ones out"
            )
        own_hz = 1.0 / float(np.median(steps)) if count > 1 else rate_hz or 0.0
        if not _HZ[0] <= own_hz <= _HZ[1]:
            raise UserError(
                f"t has {own_hz:g} frames a second, of {_HZ[0]:g} to {_HZ[1]:g}; it is in seconds, "
                "so divide milliseconds by 1000"
            )
        if rate_hz is not None and not 1.0 / _NEAR <= own_hz / rate_hz <= _NEAR:
            raise UserError(f"t has {own_hz:g} frames a second, rate_hz is {rate_hz:g}; give one")
    if labels is not None:
        names, numbers = np.unique(_array(labels, "labels", "U", (count,)), return_inverse=True)
        unknown = int(names[0] == "")  # which sorts first
        arrays["label"] = numbers - unknown
        facts |= {"label": "label", "label_names": tuple(names[unknown:].tolist()) or (NULL_LABEL,)}
    if session:
        arrays["session"], facts["session"] = np.array([str(session)]), ("session",)
    checks.number(facts["pitch_mm"], "pitch_mm", 1e-3, 1e6)
    return imported(arrays, {"frames": "frames", **facts})[0]


def _array(given: Any, name: str, kinds: str, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return an array of a shape (-1: any length) and kinds of type; Error if it is none."""
    if np.ma.is_masked(given):
        raise UserError(f"{name} are masked in places; fill them, or leave these frames out")
    try:
        array = np.asarray(list(given) if isinstance(given, Iterator) else given)
    except ValueError:
        raise UserError(f"{name} are no array: their rows are not equally long") from None
    if array.dtype.kind == "O" and kinds == "U":  # of a table
        texts = [one if isinstance(one, str) else _MISSING.get(str(one), one) for one in array.flat]
        if all(isinstance(one, str) for one in texts):
            array = np.array(texts).reshape(array.shape)
    fits = array.ndim == len(shape) and array.size > 0 and array.dtype.kind in kinds
    if not fits or any(own != size >= 0 for own, size in zip(array.shape, shape, strict=True)):
        what = "names" if kinds == "U" else "numbers"
        wanted = "(n, rows, columns)" if len(shape) == 3 else f"one for each of {shape[0]} frames"
        raise UserError(f"{name}: {array.dtype} {array.shape}; expected are {what}, {wanted}")
    return array


def columns_of(table: "pandas.DataFrame") -> dict[str, Any]:
    """Return the arrays of a table with columns as `Recording.to_pandas` has; Error if it lacks."""
    found = [(_TAXEL.fullmatch(str(name)), name) for name in getattr(table, "columns", ())]
    taxels = sorted((int(match[1]), int(match[2]), name) for match, name in found if match)
    rows, columns = (1 + max((one[i] for one in taxels), default=-1) for i in (0, 1))
    if not taxels or len(taxels) != rows * columns:
        raise UserError(
            f"the table has {len(taxels)} columns of taxels, of {rows} x {columns}; expected is a "
            "pandas table with a column r0c0, r0c1, ... for each taxel, and t as index or column"
        )
    frames = table[[name for *_, name in taxels]].to_numpy().reshape(-1, rows, columns)
    own = {"frames": frames}
    if "t" in table or table.index.name == "t":
        own["t"] = table.get("t", table.index).to_numpy()
    if "label" in table:
        own["labels"] = table["label"].to_numpy()
    return own


def imported(given: Arrays | Path, facts: Mapping[str, Any]) -> list[Source]:
    """Return the recordings in arrays, or in a file of them, by keys of a description."""
    try:
        told = config.settings(Description, facts)
    except config.ConfigError as error:
        what = "description" if isinstance(given, Path) else "recording"
        raise UserError(f"the {what} {error}") from None
    arrays = importer.read(given, told) if isinstance(given, Path) else given
    return list(importer.recordings(arrays, told))
