"""Judge a bundle on sessions that training never saw, through the device's own pipeline."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundle import Bundle
from controller.debounce import Debouncer, DebounceSettings
from controller.events import Answer, Score, judge
from controller.pipeline import Pipeline
from controller.recognizer import Recognizer
from controller.simulator.presets import PRESETS
from controller.simulator.session import EVALUATION, LABELS, Session, simulate

PRESS: Final = "press"

# What tune tries: weight of the newest probabilities, threshold to fire, threshold to re-arm.
SMOOTHING: Final = (0.3, 0.35, 0.4, 0.5, 0.6)
ON: Final = (0.6, 0.7, 0.75, 0.8, 0.85)
OFF: Final = (0.2, 0.35, 0.5)
LATENCY_LIMIT_S: Final = 0.45  # median; a faster filter must not cost more than it gives


def is_pointer(seed: int) -> bool:
    """Whether a session's touches are a mouse's: every fourth one's are."""
    return seed % 4 == 3


def unseen(preset: str, sessions: int, minutes: float) -> Iterator[Session]:
    """Simulate sessions of a preset whose seeds training never saw."""
    for seed in range(sessions):
        yield simulate(
            seed, minutes, domain=EVALUATION, pointer=is_pointer(seed), model=PRESETS[preset]
        )


@dataclass(slots=True)
class Report:
    """Figures over all sessions; each list has one entry per event.

    Attributes:
        events: The event metric on the debounced stream.
        recognised: Whether the mean probability over the event names it.
        frames: (right, all) frames.
        location_errors: Per press: median touch against the true one, mean over axes, grid units.
        off_site_errors: The same for presses more than a quarter pitch from any taxel.
        idle_minutes: Time without gestures.
        confusion: True class by recognised class, events.
    """

    events: Score = field(default_factory=Score)
    recognised: list[bool] = field(default_factory=list)
    frames: list[tuple[int, int]] = field(default_factory=list)
    location_errors: list[float] = field(default_factory=list)
    off_site_errors: list[float] = field(default_factory=list)
    idle_minutes: float = 0.0
    confusion: NDArray[np.int64] = field(
        default_factory=lambda: np.zeros((len(LABELS), len(LABELS)), dtype=np.int64)
    )

    @property
    def event_accuracy(self) -> float:
        """Share of events that the mean probability names rightly."""
        return float(np.mean(self.recognised))

    @property
    def frame_accuracy(self) -> float:
        """Share of frames whose most probable class is the true one, mean over sessions."""
        return float(np.mean([right / total for right, total in self.frames]))

    @property
    def location_error(self) -> float:
        """Mean error of a press, grid units."""
        return float(np.mean(self.location_errors))

    def table(self) -> list[tuple[str, str]]:
        """Return the figures as (name, value) rows for people."""
        score = self.events
        latency = np.array(score.latencies_s) if score.latencies_s else np.array([np.nan])
        millimetres = 10.0 * self.location_error
        off_site = float(np.mean(self.off_site_errors))
        return [
            ("events", f"{score.intended}"),
            ("event accuracy", f"{self.event_accuracy:.4f}"),
            ("frame accuracy", f"{self.frame_accuracy:.4f}"),
            ("stream F1", f"{score.f1:.4f}"),
            ("hits", f"{score.hits / score.intended:.2%}"),
            ("wrong", f"{score.wrong / score.intended:.2%}"),
            ("duplicates", f"{score.duplicates / score.intended:.2%}"),
            ("false alarms per idle minute", f"{score.false_alarms / self.idle_minutes:.3f}"),
            ("latency p50 / p95", f"{np.median(latency):.2f} / {np.quantile(latency, 0.95):.2f} s"),
            ("location error per press", f"{self.location_error:.3f} grid ({millimetres:.1f} mm)"),
            ("location error off the sites", f"{off_site:.3f} grid"),
        ]


@dataclass(frozen=True, slots=True)
class Stream:
    """What the pipeline made of one session, frame by frame."""

    session: Session
    probabilities: NDArray[np.float32]
    touches: NDArray[np.float64]


def run(bundle: Bundle, sessions: Iterable[Session], say: Callable[[str], None]) -> list[Stream]:
    """Run sessions through the bundle's pipeline."""
    recognizer = Recognizer(bundle)
    streams = []
    for number, session in enumerate(sessions, 1):
        pipeline = Pipeline(bundle, recognizer, bundle.mapping)
        steps = [
            pipeline.step(frame, float(t))
            for frame, t in zip(session.frames, session.time_s, strict=True)
        ]
        touches = [step.touch or (np.nan, np.nan) for step in steps]
        streams.append(
            Stream(session, np.stack([s.probabilities for s in steps]), np.array(touches))
        )
        say(f"session {number}: {len(session.events)} events")
    return streams


def debounced(stream: Stream, settings: DebounceSettings) -> list[Answer]:
    """Return the gestures that a debouncer makes of a stream."""
    debouncer = Debouncer(LABELS, settings)
    answers = []
    for t, probabilities in zip(stream.session.time_s, stream.probabilities, strict=True):
        label = debouncer.step(probabilities)
        if label is not None:
            answers.append(Answer(float(t), label))
    return answers


def report(streams: Sequence[Stream], settings: DebounceSettings) -> Report:
    """Return the figures of these streams with this debouncer."""
    result = Report()
    for stream in streams:
        session = stream.session
        result.events.add(judge(session.events, debounced(stream, settings)))
        best = stream.probabilities.argmax(axis=1)
        result.frames.append((int((best == session.label).sum()), len(best)))
        for number, event in enumerate(session.events):
            frames = session.event == number
            if not frames.any():
                continue
            guess = 1 + int(stream.probabilities[frames, 1:].mean(axis=0).argmax())
            true = LABELS.index(event.kind)
            result.confusion[true, guess] += 1
            result.recognised.append(guess == true)
            if event.kind == PRESS:
                _locate(result, stream, frames)
        busy = sum(event.release_s - event.onset_s for event in session.events)
        result.idle_minutes += (len(best) * float(np.median(np.diff(session.time_s))) - busy) / 60.0
    return result


def tune(streams: Sequence[Stream]) -> tuple[DebounceSettings, Score]:
    """Choose the debouncer on development streams: best F1 within the latency limit."""
    best: tuple[float, float, DebounceSettings, Score] | None = None
    for smoothing, on, off in itertools.product(SMOOTHING, ON, OFF):
        settings = DebounceSettings(smoothing, on, off)
        score = Score()
        for stream in streams:
            score.add(judge(stream.session.events, debounced(stream, settings)))
        latency = float(np.median(score.latencies_s)) if score.latencies_s else np.inf
        if latency > LATENCY_LIMIT_S and best is not None:
            continue
        rank = (round(score.f1, 4), -latency)
        if best is None or rank > best[:2]:
            best = (*rank, settings, score)
    assert best is not None
    return best[2], best[3]


def _locate(result: Report, stream: Stream, frames: NDArray[np.bool_]) -> None:
    """Add one press: the touch at its last frame is the median over all of it."""
    touches = stream.touches[frames]
    known = np.isfinite(touches[:, 0])
    if not known.any():
        return
    truth = np.nanmedian(stream.session.touch[frames], axis=0)
    error = float(np.abs(touches[known][-1] - truth).mean())
    result.location_errors.append(error)
    if np.abs(truth - np.rint(truth)).max() > 0.25:
        result.off_site_errors.append(error)
