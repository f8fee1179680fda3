"""Networks as a researcher uses them: train, run, evaluate, teach, save."""

import html
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from controller import adapt
from controller.adapt.examples import guess_symmetries
from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.recordings.recording import Recording as Source
from controller.shared.errors import UserError, count, how_to_install
from controller.shared.files import atomic_write
from controller.teach import add_gesture
from models.evaluation import evaluate as evaluation
from models.evaluation import replay
from models.results.evaluation import Figure
from models.results.verdict import GestureVerdict
from orbtouch.recordings import Recording

# Figures of `Evaluation` that every set of recordings has.
_FIGURES: Final = ("f1", "precision", "recall", "false_alarms_per_min")


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


@dataclass(frozen=True)
class Evaluation:
    """How a network did on labelled recordings; figures are with 95 % intervals over sessions.

    Attributes:
        classes: Gestures, "null" first.
        sessions: Number of recordings.
        events: Number of true gestures.
        f1: Harmonic mean of precision and recall, over gestures answered once and in time.
        precision: Share of answers that were right.
        recall: Share of gestures that were answered rightly.
        false_alarms_per_min: Answers to nothing, per idle minute.
        latency: Median time from a gesture's onset to its answer, seconds.
        position_error: Mean error of presses' positions, grid units; None: places are not known.
        confusion: Counts, (classes, classes): gestures (rows) by answers (columns), 0 is nothing.
        verdict: A line for each gesture, worst first.
    """

    classes: tuple[str, ...]
    sessions: int
    events: int
    f1: Figure
    precision: Figure
    recall: Figure
    false_alarms_per_min: Figure
    latency: Figure
    position_error: Figure | None
    confusion: NDArray[np.int64]
    verdict: tuple[GestureVerdict, ...]

    def figures(self) -> dict[str, Figure]:
        """Return the figures by name."""
        names = (*_FIGURES, "latency", "position_error")
        return {name: one for name in names if (one := getattr(self, name)) is not None}

    def __str__(self) -> str:
        return "\n".join(f"{name:20} {figure}" for name, figure in self.figures().items())

    def _repr_html_(self) -> str:
        """Return the figures and the verdict as a table, for a notebook."""
        cells = [(name.replace("_", " "), str(figure)) for name, figure in self.figures().items()]
        rows = "".join(f"<tr><td>{a}</td><td>{html.escape(b)}</td></tr>" for a, b in cells)
        lines = "<br>".join(html.escape(str(line)) for line in self.verdict)
        of = f"{count(self.events, 'gesture')} in {count(self.sessions, 'session')}"
        return f"<table><caption>{of}</caption>{rows}</table>{lines}"


class Network:
    """The networks of a bundle with their settings; see `load_network`, `train` and `teach`."""

    def __init__(self, data: bytes) -> None:
        """Read the content of a bundle's file; Error if it is damaged."""
        self._data = data
        self._bundle = bundles.parse(data)

    @classmethod
    def from_onnx(
        cls,
        source: Path | str | bytes,
        *,
        classes: Sequence[str],
        base: "Network | None" = None,
    ) -> "Network":
        """Return a network for devices from an ONNX file, and all else from another network.

        Its input is a window of images, (1 or any number, window, rows, columns), as the device
        makes them: 1.0 where untouched. It ends in Softmax or in logits. Devices run a bounded list
        of operators: dense, convolution, pooling, GRU in one direction, attention.

        Args:
            source: The file, NAME.onnx, or its content.
            classes: Names of the outputs, in their order; "null" is the one of no gesture.
            base: Source of positions, thresholds, commands and the sensor; None: as shipped.

        Raises:
            Error: onnx is missing, or the network cannot be used; the message names the operator.
        """
        from orbtouch.onnx_files import bundle_of

        lent = load_network() if base is None else base
        return cls(bundle_of(source, classes, lent._data))

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

    def run(self, recording: Recording) -> list[Command]:
        """Return the commands that the device gives for a recording, in order.

        Every stage is the device's own; the baseline is found in the recording's first second.

        Raises:
            Error: The recording is of another sensor, rate or unit.
        """
        source = self._fitting(recording)
        pipeline = Pipeline(self._bundle.settings, Recognizer(self._bundle), self._bundle.mapping)
        steps = (pipeline.step(*one) for one in zip(source.frames, source.t.tolist(), strict=True))
        return [
            Command(
                step.t_s,
                step.command.command if step.command else "",
                step.gesture,
                step.command.probability if step.command else float(step.probabilities.max()),
                step.touch,
            )
            for step in steps
            if step.gesture is not None
        ]

    def probabilities(self, recording: Recording) -> NDArray[np.float32]:
        """Return each label's probability, (n, classes); 1 for "null" until a window is full.

        Raises:
            Error: The recording is of another sensor, rate or unit.
        """
        source = self._fitting(recording)
        inputs = replay.network_inputs(source.frames, self._bundle.preprocess)
        outputs = replay.Batched(self._bundle).probabilities(inputs.windows)
        return replay.spread(outputs, inputs, len(source.frames), len(self.classes))[1]

    def evaluate(self, recordings: Iterable[Recording]) -> Evaluation:
        """Return how it answers labelled recordings, by the event metric of docs/measurements.md.

        Raises:
            Error: There is none, or one is of another sensor, rate or unit, or has no labels.
        """
        named = ((one.name, self._fitting(one)) for one in recordings)
        try:
            tallies = evaluation.evaluate(self._bundle, named, lambda line: None)
        except ValueError as error:
            raise UserError(str(error)) from None
        if not tallies:
            raise UserError("there is no recording to evaluate; give at least one")
        found = evaluation.summarise("recordings", self.classes, tallies)
        same = ("sessions", "events", "verdict", *_FIGURES)
        return Evaluation(
            **{name: getattr(found, name) for name in same},
            classes=found.labels,
            latency=found.latency_s,
            position_error=found.location.error if found.location else None,
            confusion=np.array(found.answered, dtype=np.int64),
        )

    def teach(
        self,
        label: str,
        examples: Sequence[Recording],
        *,
        command: str | Sequence[Mapping[str, Any]] | None = None,
        rotations: Literal["none", "half", "all"] | None = None,
        mirrored: bool | None = None,
    ) -> "Network":
        """Return a network that also knows a gesture, or knows it better; this one stays as it is.

        Args:
            label: Name of the gesture, new or known.
            examples: Slices, each from the beginning of a touch to its end; three to five do.
            command: What a new gesture commands: a word or rules (docs/mapping.md); None: nothing.
            rotations: Turns under which it is the same gesture: none, by half, or by quarters.
                None: guessed from the examples, as the window does; three or more are needed.
            mirrored: Whether its mirror image is the same gesture. None: guessed, too.

        Raises:
            Error: A slice holds no touch, or the other gestures would suffer.
        """
        asked: dict[int, tuple[Recording, NDArray[np.bool_]]] = {}  # by session
        for one in examples:
            replay.refuse(one._source, self._bundle)
            new = one, np.zeros(len(one._source.frames), dtype=np.bool_)
            asked.setdefault(id(one._source), new)[1][one._span] = True
        found, own = [], []
        for one, frames in asked.values():
            session = add_gesture.Session.of(self._bundle, one._source)
            names = Recording(one._source).labels
            found += session.examples(label, frames, names)
            own += session.stretches(label, frames, names)
        if not found:
            raise UserError(
                "there is no example; give three to five slices of recordings, each a second or "
                "more after its beginning"
            )
        touches = [touch for one in found if (touch := one.found(self.rate_hz)) is not None]
        turns, mirror = guess_symmetries(touches)
        turns = turns if rotations is None else rotations
        mirror = mirror if mirrored is None else mirrored
        found = [replace(one, rotations=turns, mirrored=mirror) for one in found]
        made = adapt.teach(self._data, found, command=command, own=own)
        return Network(bundles.assembled(made.manifest, made.parts))

    def save(self, path: Path | str) -> None:
        """Write it as a bundle for `load_network` and `controller --bundle`; OSError."""
        atomic_write(Path(path), self._data)

    def export(self, folder: Path | str) -> list[Path]:
        """Write the bundle's parts, ONNX models and settings, into a folder; return the files."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        written = []
        for name, data in container.unpack(self._data).items():
            atomic_write(folder / name, data)
            written.append(folder / name)
        return written

    def _fitting(self, recording: Recording) -> Source:
        """Return the recording of the implementation; Error if it is not of this sensor."""
        source = recording._cut()
        replay.refuse(source, self._bundle)
        return source

    def __repr__(self) -> str:
        return (
            f"<Network {self._bundle.hash[:8]}: {', '.join(self.classes[1:])}; "
            f"{self.shape[0]}×{self.shape[1]} at {self.rate_hz:g} Hz>"
        )

    def _repr_html_(self) -> str:
        """Return its gestures and its card, for a notebook."""
        rows = "".join(
            f"<tr><td>{html.escape(name)}</td><td>{html.escape(str(value))}</td></tr>"
            for name, value in self._bundle.card.items()
        )
        return f"{html.escape(repr(self))}<table>{rows}</table>"


def load_network(path: Path | str | None = None) -> Network:
    """Return the networks in a bundle's file, or those that ship; Error if it cannot be read."""
    data = Path(path) if path is not None else bundles.default_path()
    bundles.read(data)  # whose error names the file
    return Network(data.read_bytes())


def train(
    paths: Path | str | Sequence[Path | str],
    out: Path | str,
    *,
    say: Callable[[str], None] = print,
    **options: Any,
) -> Network:
    """Train networks from recordings, write a bundle with its card and report, and return it.

    Args:
        paths: Recordings, or folders of them, of one sensor.
        out: Bundle to write, NAME.orb; interrupted, the same call goes on where it was.
        say: Takes lines of progress.
        options: As of `models train`, such as epochs=8, split="user" or seed=1 (docs/training.md).

    Raises:
        Error: The [train] extra is missing, or the recordings cannot be learned from.
    """
    if find_spec("torch") is None:
        raise UserError(f"training needs PyTorch; {how_to_install('train')}")
    from models.training.request import Request
    from models.training.train import train as run

    given = [paths] if isinstance(paths, str | Path) else paths
    known = set(Request.__dataclass_fields__) - {"paths", "out", "command"}
    if unknown := sorted(set(options) - known):
        raise UserError(f"there is no option {unknown[0]!r}; there are {', '.join(sorted(known))}")
    try:
        run(Request(tuple(map(Path, given)), Path(out), **options), say)
    except UserError:
        raise
    except ValueError as error:
        raise UserError(str(error)) from None
    return load_network(out)
