"""Cost of a lesson: how gestures are understood before and after it, in simulated play.

The simulated hand performs each gesture that the bundle was trained with, in a random order and at
the tempo of play, with stray touches between. A taught gesture is played by variations of its
examples. The frames pass through whole pipelines: of the bundle without the gesture, of the bundle,
and of the bundle if no older gesture waits for it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from controller.adapt import few_shot, lessons
from controller.adapt.examples import Example, varied
from controller.adapt.few_shot import Progress
from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.images.frames import Frame
from controller.recognition.pipeline import Pipeline
from controller.shared.aliases import Images
from controller.shared.event_metric import Answer, Event, attach
from controller.simulator.orb import NOMINAL, OrbModel
from controller.simulator.virtual_orb import VirtualOrb

TRIES_PER_GESTURE: Final = 20
FIRST_S: Final = 1.8  # the rest image is taken before
LOOK_S: Final = (0.3, 0.7)  # from the last finger's leaving to the next gesture
STRAY_S: Final = (9.0, 20.0)  # from one stray touch to the next
STRAY_GESTURES: Final = ("brush", "rest")
PRESS_PLACES: Final = ((-0.6, 0.35), (0.6, 0.35), (0.0, -0.8))  # shares of half the grid
PLACE_SIGMA: Final = 0.15  # standard deviation of a press's place, grid units
END_S: Final = 1.0  # after the last gesture, in which an answer may come
REST_PF: Final = 40.0  # reading of an untouched taxel, in frames that are made of images
PAUSE_S: Final = 0.4  # of rest after a variation
_PLAY_SEED: Final = 0

Stream = tuple[list[Frame], list[Event]]


class Outcome(NamedTuple):
    """How often a gesture was understood, and how soon."""

    hits: int
    latency_s: float  # median, from the onset; 0 without a hit


@dataclass(frozen=True, slots=True)
class Cost:
    """Outcomes of one gesture in `of` performances."""

    label: str
    of: int
    before: Outcome  # without the lesson; no hits of a new gesture
    now: Outcome
    eager: Outcome  # as now, if no older gesture waited


@dataclass(frozen=True)
class Hand:
    """The simulated hand that performs, and its orb."""

    seed: int = 1
    quick: bool = True
    model: OrbModel = NOMINAL


def measure(
    path: Path, label: str, hand: Hand, progress: Progress = lambda share: None
) -> list[Cost]:
    """Return the cost of a gesture that a bundle was taught, one of each gesture of the bundle.

    Raises:
        BundleError, AdaptError, OSError: The bundle cannot be read.
    """
    data = path.read_bytes()
    bundle, taught = bundles.parse(data), lessons.read(data)
    old = few_shot.without(data, label)
    before = bundles.parse(bundles.assembled(old.manifest, old.parts))
    waits = {name: getattr(before.debounce, name) for name in ("patient", "awaited", "patience_s")}
    eager = replace(bundle, debounce=replace(bundle.debounce, **waits))
    streams = [performed(bundle, taught.trained[1:], hand)]
    for each in taught.taught:
        examples = [one for one in taught.examples if one.label == each]
        streams.append(shown(examples, bundle.rate_hz))
    costs = []
    for number, stream in enumerate(streams):
        now = outcomes(bundle, stream)
        then = outcomes(eager, stream) if eager.debounce != bundle.debounce else now
        past = outcomes(before, stream) if now.keys() != {label} else {label: Outcome(0, 0.0)}
        costs += [Cost(kind, TRIES_PER_GESTURE, past[kind], now[kind], then[kind]) for kind in now]
        progress((number + 1) / len(streams))
    return costs


def performed(bundle: Bundle, labels: Sequence[str], hand: Hand) -> Stream:
    """Return frames, (rows, columns) each, and events of the hand; [], [] for another sensor."""
    if (bundle.rows, bundle.columns) != (hand.model.rows, hand.model.columns):
        return [], []
    orb = VirtualOrb(hand.seed, bundle.rate_hz, model=hand.model)
    orb.quick = hand.quick
    rng = np.random.default_rng([_PLAY_SEED, hand.seed])
    known = [label for label in labels if label in orb.repertoire]
    deck = rng.permutation(np.repeat(known, TRIES_PER_GESTURE)).tolist()
    frames: list[Frame] = []
    events: list[Event] = []
    free_s, stray_s, busy = FIRST_S, rng.uniform(*STRAY_S), False
    while deck or busy or len(frames) < (free_s + END_S) * bundle.rate_hz:
        now = len(frames) / bundle.rate_hz
        if not busy and now >= free_s and deck:
            stray = now >= stray_s
            label = str(rng.choice(STRAY_GESTURES)) if stray else deck.pop()
            stray_s += stray * rng.uniform(*STRAY_S)
            orb.perform(len(frames), label, *_place(bundle, orb, label, rng), now)
            busy = True
        frames.append(orb.read((len(frames) + 1) / bundle.rate_hz))
        for truth in orb.truths():
            busy, free_s = False, len(frames) / bundle.rate_hz + rng.uniform(*LOOK_S)
            if truth.label in known:
                onset_s, release_s = truth.onset_ms / 1000, truth.release_ms / 1000
                events.append(Event(onset_s, release_s, truth.label))
    return frames, events


def _place(
    bundle: Bundle, orb: VirtualOrb, label: str, rng: np.random.Generator
) -> tuple[float, float]:
    """Return where a performance is: aside, anywhere if stray, else in the middle."""
    half = np.array([bundle.columns - 1, bundle.rows - 1]) / 2.0
    if label in STRAY_GESTURES:
        x, y = half * rng.uniform(0.0, 2.0, 2)
    elif orb.repertoire[label].place == "anywhere":
        place = np.array(PRESS_PLACES[rng.integers(len(PRESS_PLACES))])
        x, y = half * (1.0 + place) + rng.normal(0, PLACE_SIGMA, 2)
    else:
        x, y = half
    return float(x), float(y)


def shown(examples: Sequence[Example], rate_hz: float) -> Stream:
    """Return frames and events of variations of one gesture's examples, with pauses."""
    rng = np.random.default_rng(_PLAY_SEED + 2)  # other variations than those learned
    size = examples[0].images.shape[1:]
    noise = examples[0].noise() / math.sqrt(2.0)  # of two frames

    def rest(seconds: float) -> Images:
        return rng.normal(1.0, noise, (round(seconds * rate_hz), *size)).astype(np.float32)

    made, events = [rest(FIRST_S)], list[Event]()
    for number in range(TRIES_PER_GESTURE):
        one = next(varied(examples[number % len(examples)], 1, rng))
        first = sum(map(len, made))
        assert one.span is not None
        onset_s, release_s = ((first + edge + 1) / rate_hz for edge in one.span)
        events.append(Event(onset_s, release_s, one.label))
        made += [one.images, rest(PAUSE_S)]
    return list(REST_PF * np.concatenate(made)), events


def outcomes(bundle: Bundle, stream: Stream) -> dict[str, Outcome]:
    """Return what a bundle makes of each gesture of a stream."""
    frames, events = stream
    pipeline = Pipeline(bundle.settings, Recognizer(bundle), bundle.mapping)
    answers = []
    for number, frame in enumerate(frames, 1):
        step = pipeline.step(frame, number / bundle.rate_hz)
        pipeline.check_health()
        if step.gesture:
            answers.append(Answer(step.t_s, step.gesture))
    latencies: dict[str, dict[int, float]] = {event.kind: {} for event in events}
    for answer, owner in zip(answers, attach(events, answers), strict=True):
        if owner >= 0 and answer.kind == events[owner].kind:
            latencies[answer.kind].setdefault(owner, answer.time_s - events[owner].onset_s)
    return {
        kind: Outcome(len(found), float(np.median([*found.values()])) if found else 0.0)
        for kind, found in latencies.items()
    }
