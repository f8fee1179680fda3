"""Networks as a researcher uses them: train, run, evaluate, teach, save."""

import html
import logging
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, Union

import numpy as np
from numpy.typing import NDArray

from controller import adapt
from controller.adapt.examples import guess_symmetries
from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline, Step
from controller.recordings.recording import Recording as Source
from controller.shared.errors import UserError, count
from controller.shared.files import atomic_write
from controller.teach import add_gesture
from models.evaluation import evaluate as evaluation
from models.evaluation import replay
from orbtouch import checks
from orbtouch.recordings import Given, Recording, several, single
from orbtouch.results import Evaluation, evaluation_of, html_table

log = logging.getLogger("orbtouch")
SURE_SHARE = 0.95  # of all gestures' probability in a touch: names an unlabelled example


@dataclass(frozen=True, slots=True)
class Command:
    """A recognised gesture with what it commands.

    Attributes:
        t: When it was decided: seconds since the recording began, or of the orb's clock.
        name: The command, such as "left"; "" for a gesture without one.
        gesture: Its label.
        probability: Of that label, 0 to 1.
        position: Of the touch, (x, y), grid units, (0, 0) at the near left taxel; None: nowhere.
    """

    t: float
    name: str
    gesture: str
    probability: float
    position: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class Lesson:
    """What a network learned last, and what it cost.

    Attributes:
        gesture: Its label.
        examples: Number of examples.
        kept: Share of what was rehearsed of other gestures that is taken for what it was.
        delayed: Gestures that wait from now on whether this one follows, as it begins like them.
        delay: How long they wait, seconds.
        resembles: Share of the examples that the network took for each of its gestures before.
        rotations: Turns under which it is the same gesture: "none", "half" or "all".
        mirrored: Whether its mirror image is the same gesture.
    """

    gesture: str
    examples: int
    kept: float
    delayed: tuple[str, ...]
    delay: float
    resembles: dict[str, float]
    rotations: str
    mirrored: bool

    def __str__(self) -> str:
        like = ", ".join(f"{name} {share:.0%}" for name, share in self.resembles.items())
        waits = f"; {', '.join(self.delayed)} now waits {self.delay:.2f} s" if self.delayed else ""
        return (
            f"{self.gesture}: {count(self.examples, 'example')}, taken before for "
            f"{like or 'nothing'}; {self.kept:.1%} of the others kept{waits}"
        )


Base = Union["Network", Path, str, None]  # a network, that in a file, or the one that ships


class Network:
    """The networks of a bundle with their settings; see `load_network`, `train` and `teach`.

    Attributes:
        lesson: What `teach` made of it; None: it was loaded.
    """

    def __init__(self, data: bytes, lesson: Lesson | None = None) -> None:
        """Read the content of a bundle's file; Error if it is damaged."""
        if not isinstance(data, bytes):
            raise UserError(f"a {type(data).__name__} is no bundle; use load_network(path)")
        self._data, self.lesson = data, lesson
        try:
            self._bundle = bundles.parse(data)
        except UserError as error:  # which has no subject
            raise UserError(f"the bundle {error}") from None

    @classmethod
    def from_onnx(
        cls, source: Path | str | bytes, *, classes: Sequence[str], base: "Base" = None
    ) -> "Network":
        """Return a network for devices from an ONNX file, and all else from another network.

        Its input is a window of images, (1 or any number, window, rows, columns), as the device
        makes them: 1.0 where untouched. It ends in Softmax or in logits. Devices run a bounded list
        of operators: dense, convolution, pooling, GRU in one direction, attention.

        Args:
            source: The file, NAME.onnx, or its content.
            classes: Names of the outputs, in their order; "null" is the one of no gesture.
            base: Source of positions, thresholds, commands and the sensor, or its file; None: as
                shipped.

        Raises:
            Error: onnx is missing, or the network cannot be used; the message names the operator.
        """
        from orbtouch.onnx_files import bundle_of

        return cls(bundle_of(source, classes, network_of(base, "base")._data))

    @property
    def classes(self) -> tuple[str, ...]:
        """Gestures that it tells apart, "null" first."""
        return self._bundle.labels

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the sensor."""
        return self._bundle.rows, self._bundle.columns

    @property
    def rate_hz(self) -> float:
        """Frames per second of the sensor."""
        return self._bundle.rate_hz

    @checks.sentences()
    def run(self, recording: Given) -> list[Command]:
        """Return the commands that the device gives for a recording, or that in a file, in order.

        Every stage is the device's own; the baseline is found in the recording's first second.
        Error if the recording is of another sensor, rate or unit.
        """
        return [
            Command(
                step.t_s,
                step.command.command if step.command else "",
                step.gesture,
                step.command.probability if step.command else float(step.probabilities.max()),
                step.touch,
            )
            for step in self._steps(recording)
            if step.gesture is not None
        ]

    @checks.sentences()
    def probabilities(self, recording: Given) -> NDArray[np.float32]:
        """Return each label's probability, (n, classes); 1 for "null" until a window is full.

        Error if the recording is of another sensor, rate or unit.
        """
        return np.array([step.probabilities for step in self._steps(recording)], dtype=np.float32)

    @checks.sentences()
    def evaluate(self, recordings: Given | Iterable[Given]) -> Evaluation:
        """Return how it answers labelled recordings, one, several or in files, by its events.

        The event metric is that of docs/measurements.md. Error if there is no recording, or one is
        of another sensor, rate or unit, or has no labels.
        """
        named = [(one.name, self._fitting(one)) for one in several(recordings)]
        tallies = evaluation.evaluate(self._bundle, named, log.info)
        return evaluation_of(self.classes, tallies)

    @checks.sentences()
    def teach(
        self,
        label: str,
        examples: Given | Iterable[Given],
        *,
        command: str | Sequence[Mapping[str, Any]] | None = None,
        rotations: Literal["none", "half", "all"] | None = None,
        mirrored: bool | None = None,
        anyway: bool = False,
    ) -> "Network":
        """Return a network that also knows a gesture, or knows it better; this one stays as it is.

        Its `lesson` has what that cost.

        Args:
            label: Name of the gesture, new or known.
            examples: Slices, each from the beginning of a touch to its end; three to five do.
            command: What a new gesture commands: a word or rules (docs/mapping.md); None: nothing.
            rotations: Turns under which it is the same gesture: none, by half, or by quarters.
                None: guessed from the examples, as the window does; three or more are needed.
            mirrored: Whether its mirror image is the same gesture. None: guessed, too.
            anyway: Take examples that have another name, too.

        Raises:
            Error: A slice holds no touch, or has another name: in its recording, or without labels
                by this network; or the other gestures would suffer.
        """
        checks.one_of(rotations or "all", "rotations", ("none", "half", "all"))
        examples = several(examples)
        asked: dict[int, tuple[Recording, NDArray[np.bool_]]] = {}  # by session
        for one in examples:
            replay.refuse(one._source, self._bundle)
            new = Recording(one._source, one.name), np.zeros(len(one._source.frames), np.bool_)
            asked.setdefault(id(one._source), new)[1][one._span] = True
        shares = {key: self.probabilities(whole) for key, (whole, _) in asked.items()}
        taken = [self._taken(label, one, shares[id(one._source)], anyway) for one in examples]
        found, own = [], []
        for whole, frames in asked.values():
            session, labels = add_gesture.Session.of(self._bundle, whole._source), whole.labels
            found += session.examples(label, frames, labels)
            own += session.stretches(label, frames, labels)
        if not found:
            raise UserError("there is no example; give slices a second or more after the beginning")
        touches = [touch for one in found if (touch := one.found(self.rate_hz)) is not None]
        guessed = guess_symmetries(touches)
        turns, mirror = rotations or guessed[0], guessed[1] if mirrored is None else mirrored
        found = [replace(one, rotations=turns, mirrored=mirror) for one in found]
        made = adapt.teach(self._data, found, command=command, own=own)
        before, now = self._bundle.debounce.patient, made.debounce
        delayed = tuple(one for one in now.patient if one not in before)
        like = {name: taken.count(name) / len(taken) for name in self.classes[1:] if name in taken}
        cost = len(found), made.kept, delayed, now.patience_s, like
        lesson = Lesson(label, *cost, turns, mirror)
        log.info("%s", lesson)
        return Network(bundles.assembled(made.manifest, made.parts), lesson)

    def _taken(self, label: str, one: Recording, shares: NDArray[np.float32], anyway: bool) -> str:
        """Return what the network takes an example for, "" nothing; Error if it has another name.

        That is what its recording labels it, else what the network surely takes it for.
        """
        touched = shares[one._span, 1:][shares[one._span, 0] < 0.5]
        total = touched.sum(axis=0)
        taken = self.classes[1 + int(total.argmax())] if len(touched) else ""
        named = Counter(one.labels.tolist()).most_common(1)[0][0]
        by = "its recording labels it"
        if not named and label not in self.classes and total.max() >= SURE_SHARE * total.sum():
            named, by = taken, "the network takes it for"
        if named not in ("", label) and not anyway:
            raise UserError(
                f"the example from {one.t[0]:.2f} to {one.t[-1]:.2f} s is no {label}: {by} "
                f"{named}; leave it out, relabel it, or say anyway=True"
            )
        return taken

    @checks.sentences()
    def save(self, path: Path | str) -> None:
        """Write it as a bundle for `load_network` and `controller --bundle`; Error if it fails."""
        atomic_write(checks.path(path), self._data)

    @checks.sentences()
    def export(self, folder: Path | str) -> list[Path]:
        """Write the bundle's parts, ONNX models and settings, into a folder; return the files."""
        folder = checks.path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        parts = container.unpack(self._data)
        for name, data in parts.items():
            atomic_write(folder / name, data)
        return [folder / name for name in parts]

    def _steps(self, recording: Given) -> Iterator[Step]:
        """Yield what the device makes of each frame; Error if the recording does not fit."""
        source = self._fitting(recording)
        pipeline = Pipeline(self._bundle.settings, Recognizer(self._bundle), self._bundle.mapping)
        for frame, t_s in zip(source.frames, source.t.tolist(), strict=True):
            yield pipeline.step(frame, t_s)

    def _fitting(self, recording: Given) -> Source:
        """Return the recording of the implementation; Error if it is not of this sensor."""
        source = single(recording)._cut()
        replay.refuse(source, self._bundle)
        return source

    def __repr__(self) -> str:
        return (
            f"<Network {self._bundle.hash[:8]}: {', '.join(self.classes[1:])}; "
            f"{self.shape[0]}×{self.shape[1]} at {self.rate_hz:g} Hz>"
        )

    def _repr_html_(self) -> str:
        """Return its gestures and its card, for a notebook."""
        return f"{html.escape(repr(self))}{html_table(self._bundle.card)}"


@checks.sentences()
def load_network(path: Path | str | None = None) -> Network:
    """Return the networks in a bundle's file, or those that ship; Error if it cannot be read."""
    data = checks.path(path) if path is not None else bundles.default_path()
    bundles.read(data)  # whose error names the file
    return Network(data.read_bytes())


def network_of(given: Base, what: str) -> Network:
    """Return a network, that in a file, or the one that ships; Error for anything else."""
    if given is None or isinstance(given, str | Path):
        return load_network(given)
    if not isinstance(given, Network):
        raise UserError(f"{what} is a {type(given).__name__}; give a network, or its file")
    return given
