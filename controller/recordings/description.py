"""Descriptions of arrays of other sensors, in TOML (docs/recording.md)."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from controller.recognition.images.scale import SIGNS
from controller.recordings.recording import LABELLERS, PICOFARAD, RecordingError
from controller.shared.config import checked, settings

TIME_UNITS: Final = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}  # seconds
ALONE: Final = "01"  # user and session if the description names none


@dataclass(frozen=True, slots=True)
class Description:
    """Meaning of the arrays of a file; the names of the attributes are the keys of the TOML."""

    # array of frames, (n, rows, columns), or (n, taxels) with `rows` and `columns`; in a table a
    # pattern of its columns, such as "c*"
    frames: str
    pitch_mm: float = field(metadata={"range": (1e-3, 1e6)})  # distance between adjacent taxels
    unit: str = PICOFARAD  # of the frames
    # what a touch does to the frames, of `SIGNS`; "": it is found out
    sign: str = field(default="", metadata={"choices": ("", *SIGNS)})
    rows: int = 0  # taxel rows; 0: as in the array
    columns: int = 0  # taxel columns; 0: as in the array
    rate_hz: float = 0.0  # frames per second; 0: frames over time
    time: str = ""  # array of times, (n,); "": uniform intervals at `rate_hz`
    time_unit: str = field(default="s", metadata={"choices": tuple(TIME_UNITS)})  # of these times
    # a longer interval begins a new stretch, as time that goes back does; 0: none
    gap_s: float = 0.0
    drop_repeated: bool = False  # leave out frames that have the time of the frame before
    even_times: bool = False  # space the frames of a stretch evenly, at the rate
    # array of the untouched sensor, (rows, columns), or of frames, of which it is the first; "":
    # unknown
    rest: str = ""
    label: str = ""  # array of class numbers, (n,); "": no labels
    # names of the classes, counted from 0, or the array that holds them
    label_names: str | tuple[str, ...] = ()
    null: str = ""  # name of the class without a gesture; "": there is none
    # label column of the labels
    labeller: str = field(default="label", metadata={"choices": LABELLERS})
    # array of the place of each labelled frame, x and y in grid units from the lower left taxel,
    # NaN: as before, (n, 2); "": unknown
    place: str = ""
    marks: str = ""  # array of texts, (n,); each that differs from the one before is a mark
    user: str = ALONE  # ID of the user if there is no `subject`
    subject: str = ""  # array of the user of each frame, (n,); "": all frames are of one user
    session: tuple[str, ...] = ()  # arrays that distinguish sessions of one user, each (n,)
    device: str = "imported"  # serial number of the sensor, or of its kind
    hardware: str = ""  # kind of sensor, as text
    protocol: str = ""  # name of the task

    def __post_init__(self) -> None:
        if not self.time and not self.rate_hz:
            raise ValueError("neither 'time' nor 'rate_hz', so the rate is unknown")
        if 0.0 < self.rate_hz < 1.0:
            raise ValueError(
                f"rate_hz = {self.rate_hz:g}; expected is 1 or more frames a second; a period of "
                f"{self.rate_hz:g} s is rate_hz = {1.0 / self.rate_hz:g}"
            )
        if self.label and not self.label_names:
            raise ValueError("'label', but no 'label_names' for its numbers")
        if isinstance(self.label_names, list):
            object.__setattr__(self, "label_names", tuple(self.label_names))
        if self.place and not self.label:
            raise ValueError("'place', but no 'label' of the gesture that is there")
        if self.even_times and not self.time:
            raise ValueError("'even_times', but no 'time' to even")
        names = self.label_names
        if not isinstance(names, str | tuple) or not all(isinstance(name, str) for name in names):
            raise ValueError(f"label_names = {names!r}; expected is a text or a list of texts")

    @property
    def arrays(self) -> set[str]:
        """Names of all arrays that it mentions."""
        grouping = {self.subject, *self.session} - {""}
        names = {self.frames, self.time, self.label, self.rest, self.place, self.marks}
        names |= {*grouping, *(f"{n}_names" for n in grouping)}
        names |= {self.label_names} if isinstance(self.label_names, str) else set()
        return names - {""}


def described(path: Path) -> Description:
    """Return the description in a file; UserError if it cannot be read, or is impossible."""
    page = "orbtouch docs recording"
    return checked(path, lambda table: settings(Description, table), RecordingError, page)
