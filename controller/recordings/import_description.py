"""Descriptions of foreign arrays in TOML, by which they are imported as recordings."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

from controller.config import read_toml
from controller.recordings.recording import LABELLERS, PICOFARAD, RecordingError

NULL: Final = "null"


@dataclass(frozen=True, slots=True)
class Description:
    """Meaning of the arrays of a file; the names of the attributes are the keys of the TOML.

    Attributes:
        frames: Array of frames, (n, rows, columns), or (n, taxels) with the next two.
        rows: Taxel rows; 0: as the array has them.
        columns: Taxel columns; 0: as the array has them.
        unit: Of the frames.
        pitch_mm: Distance of two taxels.
        rate_hz: Frames per second; 0: from the median interval.
        time: Array of times in seconds, (n,); "": one frame after the other at `rate_hz`.
        gap_s: A longer interval begins a new stretch, as time that goes back does; 0: none.
        drop_repeated: Leave out frames that have the time of the frame before.
        label: Array of class numbers, (n,); "": no labels.
        label_names: Names of the classes, counted from 0, or the array that holds them.
        null: Name of the class in which nothing is done; "": there is none.
        labeller: The label column that the labels belong to.
        subject: Array of the person of each frame, (n,); "": all are of one person.
        session: Arrays that distinguish sessions of one person, each (n,).
        device: Serial number of the sensor, or of its kind.
        hardware: Kind of sensor, for people.
        protocol: Name of the task.
    """

    frames: str
    pitch_mm: float
    unit: str = PICOFARAD
    rows: int = 0
    columns: int = 0
    rate_hz: float = 0.0
    time: str = ""
    gap_s: float = 0.0
    drop_repeated: bool = False
    label: str = ""
    label_names: str | tuple[str, ...] = ()
    null: str = ""
    labeller: str = "label"
    subject: str = ""
    session: tuple[str, ...] = ()
    device: str = "imported"
    hardware: str = ""
    protocol: str = ""

    @property
    def arrays(self) -> set[str]:
        """Names of all arrays that it mentions."""
        grouping = {self.subject, *self.session} - {""}
        names = {self.frames, self.time, self.label, *grouping, *(f"{n}_names" for n in grouping)}
        names |= {self.label_names} if isinstance(self.label_names, str) else set()
        return names - {""}


_WORDS: Final[dict[type, str]] = {
    str: "a text",
    int: "a whole number",
    float: "a number",
    bool: "true or false",
    tuple: "a list of texts",
}
_NEEDED: Final[dict[str, type]] = {"frames": str, "pitch_mm": float}
_KINDS: Final[dict[str, type]] = _NEEDED | {
    field.name: type(field.default) for field in fields(Description) if field.name not in _NEEDED
}


def read(path: Path) -> Description:
    """Return the description in a file.

    Raises:
        UserError: It cannot be read, or a value is impossible.
    """
    table = read_toml(path)
    try:
        return parse(table)
    except RecordingError as error:
        raise RecordingError(f"the description {path} {error}; see docs/recording.md") from None


def parse(given: Mapping[str, Any]) -> Description:
    """Return the description in a table of TOML.

    Raises:
        RecordingError: A key is unknown, is missing, or has an impossible value.
    """
    for key in given:
        if key not in _KINDS:
            raise RecordingError(f"has the unknown key {key!r}; there are {', '.join(_KINDS)}")
    for key in _NEEDED:
        if key not in given:
            raise RecordingError(f"has no {key!r}")
    made = Description(**{key: _value(key, value) for key, value in given.items()})
    if not made.time and not made.rate_hz:
        raise RecordingError("has neither 'time' nor 'rate_hz', so the rate is unknown")
    if made.labeller not in LABELLERS:
        known = ", ".join(LABELLERS)
        raise RecordingError(f"has labeller = {made.labeller!r}, which is none of {known}")
    if made.label and not made.label_names:
        raise RecordingError("has 'label', but no 'label_names' for its numbers")
    for key in ("pitch_mm", "rate_hz", "gap_s", "rows", "columns"):
        value = getattr(made, key)
        if not 0 <= value < 1e6 or (key == "pitch_mm" and not value):
            raise RecordingError(f"has {key} = {value}, which is impossible")
    return made


def _value(key: str, value: Any) -> Any:
    """Return one value, of the type that its key wants."""
    kind = _KINDS[key]
    if key == "label_names" and isinstance(value, str):
        return value  # of the array that holds them
    if kind is float and type(value) is int:
        return float(value)
    if kind is tuple and isinstance(value, list) and all(isinstance(item, str) for item in value):
        return tuple(value)
    if type(value) is not kind:
        raise RecordingError(f"has {key} = {value!r}, which is not {_WORDS[kind]}")
    return value
