"""Recordings as a researcher holds them: arrays, slices by seconds, tables and plots."""

import base64
import html
import io
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from controller.recordings import edit, reader, recording
from controller.shared import config
from controller.shared.config import ConfigError
from controller.shared.errors import UserError, how_to_install
from controller.shared.files import atomic_write
from models.data.examples import column, labellers
from orbtouch import arrays, checks, windows
from orbtouch.windows import Windows

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes


Given = Union["Recording", Path, str]  # a recording, or the path of its file


class Recording:
    """A session of n frames, or a slice of one; made by `load_recording`, `simulate` and `record`.

    `session[2.0:3.5]` is the slice from 2.0 to 3.5 s, with the times of the whole session, which
    it remembers: `Network.teach` looks at the frames before and after. Nothing is changed in place.

    Attributes:
        name: Of the file or simulation, for messages.
    """

    def __init__(
        self, source: recording.Recording, name: str = "recording", span: slice | None = None
    ) -> None:
        """Wrap a recording of the implementation; use `load_recording` or `from_arrays`."""
        if not isinstance(source, recording.Recording):
            raise UserError("make a recording of arrays with Recording.from_arrays(frames, t)")
        self._source = source
        self._span = slice(0, len(source.frames)) if span is None else span
        self.name = name

    @classmethod
    @checks.sentences()
    def from_arrays(
        cls,
        frames: ArrayLike | Iterable[ArrayLike],
        t: ArrayLike | None = None,
        rate_hz: float | None = None,
        labels: ArrayLike | None = None,
        *,
        unit: str = "pF",
        pitch_mm: float = 10.0,
        user: str = "01",
        session: str = "",
        sign: arrays.Sign = "",
    ) -> "Recording":
        """Return a recording of arrays, of any sensor.

        Args:
            frames: Finite readings, (n, rows, columns); row 0 is the player's far side.
            t: Rising time of each frame, (n,), seconds, counted from the first in the recording;
                None: frame k, from 1, ends at k / `rate_hz`.
            rate_hz: Frames per second, 1 to 10,000; None: frames over time.
            labels: Name of the gesture in each frame, (n,), "null" for none, "" for unknown.
            unit: Of the frames; "pF" is divided by rest, of others rest is subtracted.
            pitch_mm: Distance of neighbouring taxels.
            user: ID of the person, letters and digits.
            session: ID of the session; "": the only one.
            sign: What a touch does to the readings: "falls" or "rises"; "": found out.

        Raises:
            Error: An array has another shape, type or length; the message names it.
        """
        facts = {"unit": unit, "pitch_mm": pitch_mm, "user": user, "sign": sign}
        made = arrays.source(frames, t, rate_hz, labels, session, **facts)
        return cls(made, f"{user} {made.origin.session}")

    @classmethod
    def from_pandas(cls, table: "pandas.DataFrame", **facts: Any) -> "Recording":
        """Return a recording of a table as `to_pandas` returns it.

        The time is the index "t" or a column of that name; without, `rate_hz` is needed. Other
        keywords are as of `from_arrays`. Error if a column is missing.
        """
        return cls.from_arrays(**(arrays.columns_of(table) | facts))

    @checks.sentences()
    def windows(self, window: int = 0, *, every: int = 1) -> Windows:
        """Return the labelled windows, made by the device's own stages, for an own network.

        The sensor's scale and baseline are found in the whole session, also of a slice; no window
        spans a missing or excluded frame.

        Args:
            window: Images in a window, 2 to 250; 0: those of a second.
            every: Take each window that begins so many frames after the one before.

        Raises:
            Error: There are no labels, no quiet second, or no touch where the scale needs one.
        """
        checks.window(window)
        checks.whole(every, "every", 1, 1_000_000)
        settings = windows.settings_of([self._source], window)
        made = windows.cut(self._source, self.name, settings, self.classes, self._span, every)
        if not len(made.X):
            raise UserError(f"{self.name} has no labelled window after a quiet second")
        return made

    @property
    def frames(self) -> NDArray[np.float32]:
        """Readings as measured, (n, rows, columns), in `unit`; row 0 is the player's far side."""
        return self._source.frames[self._span]

    @property
    def t(self) -> NDArray[np.float64]:
        """Time of each frame, (n,), seconds since the session began."""
        return self._source.t[self._span]

    @property
    def labels(self) -> NDArray[np.str_]:
        """The gesture in each frame, (n,): "null" none, "" unknown.

        It is the truth of a simulation, else what people labelled: by button, key or cue.
        """
        names, sources = np.array([*self.classes, ""]), labellers(self._source, least=0)
        numbers = column(self._source, sources[0]) if sources else np.full(len(self._source.t), -1)
        return np.asarray(names[numbers[self._span]])

    @property
    def classes(self) -> tuple[str, ...]:
        """Names of the gestures, "null" first."""
        return self._source.origin.labels

    @property
    def unit(self) -> str:
        """Unit of the frames; "pF", or what the sensor counts in."""
        return self._source.origin.unit

    @property
    def user(self) -> str:
        """ID of the person; "" unknown."""
        return self._source.origin.user

    @property
    def session(self) -> str:
        """ID of the session, unique for the person; "" unknown."""
        return self._source.origin.session

    @property
    def rate_hz(self) -> float:
        """Frames per second."""
        return self._source.rate_hz

    @property
    def duration(self) -> float:
        """Time from the first frame to the last, seconds."""
        return float(self.t[-1] - self.t[0]) if len(self) else 0.0

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, seconds: "slice[float | None, float | None, None]") -> "Recording":
        """Return the frames of a time, such as `session[2.0:3.5]`, seconds; its end is not in it.

        TypeError if it is no slice of two times; Error if there is no frame in that time.
        """
        given = (seconds.start, seconds.stop, seconds.step) if isinstance(seconds, slice) else ("",)
        if given[2:] != (None,) or any(isinstance(one, str) for one in given):
            raise TypeError("a recording is sliced by seconds, such as session[2.0:3.5]")
        ends = zip(given[:2], (-np.inf, np.inf), strict=True)
        bounds = [end if one is None else one for one, end in ends]
        first, end = np.searchsorted(self._source.t, bounds).tolist()
        first, end = max(first, self._span.start), min(end, self._span.stop)
        if first >= end:
            raise UserError(
                f"there is no frame from {bounds[0]:g} to {bounds[1]:g} s; the recording has "
                f"frames from {self.t[0]:g} to {self.t[-1]:g} s"
            )
        return Recording(self._source, self.name, slice(first, end))

    def gestures(self, label: str) -> Iterator["Recording"]:
        """Yield a slice for each time a gesture lasts, in order; none if it never does."""
        runs = np.flatnonzero(np.diff(self.labels == label, prepend=False, append=False))
        for first, end in (runs.reshape(-1, 2) + self._span.start).tolist():
            yield Recording(self._source, self.name, slice(first, end))

    @checks.sentences()
    def save(self, path: Path | str) -> None:
        """Write it, or the slice, as a file that all commands read; Error if that fails."""
        atomic_write(checks.path(path), edit.sealed(self._cut()))

    def relabel(self, label: str | None = None, *, excluded: bool | None = None) -> "Recording":
        """Return the whole session with another label in this slice, `session[2.0:3.5]`.

        Args:
            label: One of `classes`, or "unknown"; None leaves it.
            excluded: Whether training leaves these frames out; None leaves that.

        Raises:
            Error: There is no such label, or nothing is to be changed.
        """
        source, where = self._source, self._where
        known = labellers(source, least=0)
        own = "label" if known[:1] in ([], ["true"]) else known[0]
        changed = edit.relabel(source, *where, label=label, column=own, excluded=excluded)
        return Recording(changed, self.name)

    @property
    def _where(self) -> tuple[float, float, str]:
        """Begin and end of the slice, seconds, and its name."""
        return float(self.t[0]), float(np.nextafter(self.t[-1], np.inf)), self.name

    def _cut(self) -> recording.Recording:
        """Return what is inside the slice alone, as the implementation has it."""
        whole = len(self) == len(self._source.frames)
        return self._source if whole else edit.trim(self._source, *self._where)

    def to_pandas(self) -> "pandas.DataFrame":
        """Return a table: time as index, a column a taxel ("r0c0" …), and "label"; needs pandas."""
        pandas = checks.needed("pandas", "a table", "pip install pandas")
        names = [f"r{r}c{c}" for r, c in np.ndindex(self.frames.shape[1:])]
        index = pandas.Index(self.t, name="t")
        table = pandas.DataFrame(self.frames.reshape(len(self), -1), index, names)
        return table.assign(label=self.labels)

    def plot(self, axes: "Axes | None" = None) -> "Axes":
        """Draw each taxel over time, with the labelled gestures shaded; needs Matplotlib.

        Without `axes` a new figure is made. The taxels' readings are in `unit`, less their medians.
        """
        figure = checks.needed("matplotlib.figure", "a plot", how_to_install("plot")).Figure
        axes = axes or figure(figsize=(9, 3), layout="constrained").add_subplot()
        readings = self.frames.reshape(len(self), -1)
        axes.plot(self.t, readings - np.median(readings, axis=0), lw=0.8)
        shaded = {}
        for number, label in enumerate(self.classes[1:]):
            for one in self.gestures(label):
                shaded[label] = axes.axvspan(*one.t[[0, -1]], fc=f"C{number}", alpha=0.25)
        axes.legend(shaded.values(), shaded, loc="lower right", fontsize=8, frameon=False)
        axes.set(xlabel="time, s", ylabel=f"change, {self.unit}", xmargin=0)
        return axes

    def __repr__(self) -> str:
        size = "×".join(map(str, self.frames.shape[1:]))
        return (
            f"<Recording {self.name!r}: {len(self)} frames of {size}, {self.duration:.1f} s at "
            f"{self.rate_hz:.1f} Hz, {self.unit}>"
        )

    def _repr_html_(self) -> str:
        """Return its summary and, where Matplotlib is there, its plot, for a notebook."""
        text, picture = html.escape(repr(self)[1:-1]), io.BytesIO()
        try:
            figure: Any = self.plot().figure
        except UserError:
            return text
        figure.savefig(picture, format="png", dpi=80)
        data = base64.b64encode(picture.getvalue()).decode()
        return f'{text}<br><img alt="{text}" src="data:image/png;base64,{data}">'


@checks.sentences()
def import_recordings(path: Path | str, **description: Any) -> list[Recording]:
    """Return the recordings in a CSV, .npz or .npy of another sensor, one a user and session.

    Args:
        path: File of arrays, or a table with a column for each taxel.
        description: Keys of docs/recording.md#other-sensors, such as frames="c*", rows=5,
            columns=5, pitch_mm=4.1, unit="counts", time="t", label="task",
            label_names="task_names" and null="rest".

    Raises:
        Error: The file is not as described; the message names line or array.
    """
    found = arrays.imported(checks.path(path), description)
    return [Recording(one, f"{one.origin.user} {one.origin.session}") for one in found]


@checks.sentences()
def load_recording(path: Path | str) -> Recording:
    """Return the recording in a file; Error if it is none, with the reason."""
    return Recording(reader.load(checks.path(path)), Path(path).stem)


def single(given: object) -> Recording:
    """Return a recording, or that in a file; Error for anything else."""
    if isinstance(given, Recording):
        return given
    if isinstance(given, str | Path):
        return load_recording(given)
    raise UserError(
        f"a {type(given).__name__} is no recording; give one, or the path of its file; arrays "
        "become one by Recording.from_arrays"
    )


def several(given: Given | Iterable[Given]) -> list[Recording]:
    """Return one recording or more, those in files, too; Error for anything else, and for none."""
    if isinstance(given, str | Path | Recording) or not isinstance(given, Iterable):
        return [single(given)]
    found = [single(each) for each in given]
    if not found:
        raise UserError("there is no recording; give at least one")
    ids = [one._source.origin.id or str(id(one._source)) for one in found]
    if len({(name, str(one._span)) for name, one in zip(ids, found, strict=True)}) < len(found):
        raise UserError("a recording is given twice, which would count as two; give each once")
    return found


@checks.sentences()
def simulate(
    *,
    minutes: float = 2.0,
    user: int = 0,
    session: int = 0,
    seed: int = 0,
    preset: str = "nominal",
    hand: Literal["person", "pointer"] = "person",
    rate_hz: float = 40.0,
    gestures: tuple[str, ...] = ("press", "pinch", "twist_cw", "twist_ccw"),
) -> Recording:
    """Return a simulated session with the truth beside every frame.

    The same arguments give the same session.

    Args:
        minutes: Its length.
        user: Number of the simulated person, from 0; each has a style of their own.
        session: Number of their session, from 0; each is on another orb.
        seed: Of everything random, 0 or more.
        preset: Noise of the orb, "nominal" or "paper-snr".
        hand: Fingers on the dome, or a mouse on its picture.
        rate_hz: Frames per second, 1 to 200.
        gestures: Labels that are made in any order (docs/gestures.md).

    Raises:
        Error: An argument is out of its range; the message names it.
    """
    from models.data.simulate import DataSet

    given = {"seed": seed, "minutes": minutes, "preset": preset, "hand": hand}
    given |= {"rate_hz": rate_hz, "gestures": gestures}
    for value, what in ((user, "user"), (session, "session")):
        checks.whole(value, what, 0, 1_000_000)
    try:
        made = config.settings(DataSet, given).session(user, session)
    except ConfigError as error:
        raise UserError(f"simulate {error}") from None
    return Recording(made, f"{preset} {user + 1:02d}-{session + 1:02d}")
