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
    """How to read the arrays of a file; the names of its attributes are the keys of the TOML.

    Attributes:
        frames: Array of frames, (n, rows, columns), or (n, taxels) with the next two.
        rows: Taxel rows; 0: as the array has them.
        columns: Taxel columns; likewise.
        unit: Of the frames.
        pitch_mm: Distance of two taxels.
        rate_hz: Frames per second; 0: the median of the times.
        time: Array of times in seconds, (n,); "": every frame one interval after the other.
        gap_s: A longer interval begins a new stretch, and so does time that goes back; 0: only
            that does.
        drop_repeated: Frames that have the time of the frame before are left out.
        label: Array of numbers that name classes, (n,); "": nobody labelled anything.
        label_names: The names of the classes, counted from 0, or the array that holds them.
        null: Which of the names means that nothing is done; "": none does.
        labeller: Which label column the labels belong into.
        subject: Array that says whose each frame is, (n,); "": all are one person's.
        session: Arrays that tell sessions of one person apart, (n,).
        device: Serial number of the sensor, or of its kind.
        hardware: What kind of sensor it is, for people.
        protocol: What people were asked to do.
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
        """The arrays that it names."""
        names = {self.frames, self.time, self.label, self.subject, *self.session}
        if isinstance(self.label_names, str):
            names.add(self.label_names)
        for named in (self.subject, *self.session):
            names.add(f"{named}_names" if named else "")
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
        UserError: It cannot be read, or says something impossible.
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
        raise RecordingError("has neither 'time' nor 'rate_hz', so nobody knows the rate")
    if made.labeller not in LABELLERS:
        raise RecordingError(
            f"has labeller = {made.labeller!r}, which is none of {', '.join(LABELLERS)}"
        )
    if made.label and not made.label_names:
        raise RecordingError("has 'label', but no 'label_names' to say what its numbers mean")
    for key in ("pitch_mm", "rate_hz", "gap_s", "rows", "columns"):
        if not 0 <= getattr(made, key) < 1e6 or (key == "pitch_mm" and not made.pitch_mm):
            raise RecordingError(f"has {key} = {getattr(made, key)}, which is impossible")
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
