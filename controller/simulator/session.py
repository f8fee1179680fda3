"""Whole simulated sessions: a hand at play for minutes, with the truth beside every frame."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from controller.shared.event_metric import Event
from controller.simulator.dome.faults import Fault
from controller.simulator.hand.gesture_file import Repertoire, shipped
from controller.simulator.hand.performance import GESTURES, LOCATED
from controller.simulator.hand.session_script import SessionScript, hold_button
from controller.simulator.hand.user_style import UserStyle, draw_mood, draw_style
from controller.simulator.orb import NOMINAL, OrbModel, OrbSimulator

Protocol = Literal["free", "blocks"]

LABELS: Final = ("null", *GESTURES)

# Families of seeds that never meet. (The virtual orb that people play with is family 1.)
TRAINING: Final = 0  # only training may use it
DATA: Final = 4  # data sets: models/data/simulate.py
# Seeds of data sets that are for tests: no training and no tuning accepts them.
TEST_SEEDS: Final = range(900_000, 1_000_000)

_PLACEMENT_MM: Final = 1.5  # deviation of a session's dome from where the user thinks it is
_CHUNK: Final = 2_000_000  # taxels times steps simulated at once; bounds memory


@dataclass(frozen=True, slots=True)
class Session:
    """One simulated session."""

    frames: NDArray[np.float32]  # scans, float32 (frames, rows, columns), pF
    time_s: NDArray[np.float64]  # end of each scan, (frames,)
    label: NDArray[np.int8]  # index into `labels` of what truly happens, (frames,)
    touch: NDArray[np.float32]  # true place of a press, grid units, else NaN, (frames, 2)
    events: tuple[Event, ...]  # true gestures in order
    event: NDArray[np.int32]  # index into `events` per frame, -1 between them, (frames,)
    distractors: tuple[Event, ...]  # contacts that are no gestures, in order
    button: NDArray[np.int8]  # what the label button gives, as `label`
    contact: NDArray[np.float32]  # x, y (grid units), depth (mm) or NaN, (frames, SLOTS, 3)
    labels: tuple[str, ...]  # "null" and the gestures
    style: UserStyle  # who played, in this session's mood


def simulate(
    seed: int | Sequence[np.random.SeedSequence],
    minutes: float,
    *,
    user: int | None = None,
    style: UserStyle | None = None,
    pointer: bool = False,
    rate_hz: float = 10.0,
    model: OrbModel = NOMINAL,
    inflation: float = 0.0,
    protocol: Protocol = "free",
    gestures: Sequence[str] = GESTURES,
    repertoire: Repertoire | None = None,
    faults: Iterable[Fault] = (),
    day: int = 0,
    quick: float = 0.0,
    unruly: float = 0.0,
) -> Session:
    """Simulate one session: an orb, a user in a mood, and what they do for some minutes.

    Args:
        seed: Which session; or the seeds of its orb, people, order, placement and button.
        minutes: Its length.
        user: Which user; by default the session's own.
        style: A user in place of a drawn one.
        pointer: The touches are a pointer's on a screen, not a hand's.
        rate_hz: Frames per second.
        model: The orb's constants.
        inflation: Relative deviation of the apex stretch beyond 1.
        protocol: "free": gestures and distractors in any order; "blocks": class by class.
        gestures: Labels that are played.
        repertoire: What the hand can do; the gestures that ship if not given.
        faults: What is broken from the first frame on.
        day: Which of this orb's sessions: other drift and noise, the same taxels.
        quick: Share of a free stream's turns in which quick gestures follow each other.
        unruly: Share of the other turns with slides, winding up, resting hands and the like.

    Raises:
        ValueError: The hand does not know a gesture.
    """
    if isinstance(seed, int):
        seed = np.random.SeedSequence([TRAINING, seed]).spawn(5)
    orb, people, order, placement, labeller = seed
    if user is not None:
        people = np.random.SeedSequence([TRAINING, 1_000_000 + user])
    rng = np.random.default_rng(order)
    style = draw_mood(style or draw_style(np.random.default_rng(people)), rng)
    style = replace(style, pointer=pointer)
    setting = np.random.default_rng(placement)
    x, y = setting.normal(0.0, _PLACEMENT_MM, 2)
    if inflation > 0.0:
        fuller = float(np.exp(setting.normal(0.0, inflation)))
        stretch = 1.0 + (model.mechanics.apex_stretch - 1.0) * fuller
        model = replace(model, mechanics=replace(model.mechanics, apex_stretch=stretch))
    away_mm = (0.0, 0.0) if pointer else (float(x), float(y))
    simulator = OrbSimulator(orb, rate_hz, model=model, day=day)
    simulator.electronics.switch(faults)
    frames, per_frame = round(minutes * 60 * rate_hz), simulator.steps_per_frame
    grid = (model.rows, model.columns, model.pitch_mm)
    hand = SessionScript(
        frames * per_frame, rate_hz * per_frame, grid, style, away_mm, repertoire or shipped(), rng
    )
    if protocol == "free":
        hand.stream(gestures, quick, unruly)
    else:
        hand.blocks(gestures)
    labels = ("null", *gestures)
    time_s = np.asarray((np.arange(frames) + 1.0) / rate_hz, dtype=np.float64)
    label, event = hand.truth(time_s, labels)
    contact = hand.contact(per_frame)
    pressed = np.isin(label, [labels.index(name) for name in LOCATED if name in labels])
    return Session(
        frames=_scan(simulator, hand),
        time_s=time_s,
        label=label,
        touch=np.where(pressed[:, None], hand.touch(event, per_frame), np.float32(np.nan)),
        events=tuple(hand.events),
        event=event,
        distractors=tuple(hand.distractors),
        button=hold_button(hand.events, labels, time_s, np.random.default_rng(labeller)),
        contact=contact,
        labels=labels,
        style=style,
    )


def _scan(simulator: OrbSimulator, hand: SessionScript) -> NDArray[np.float32]:
    """Let the orb feel the whole session, (frames, rows, columns), pF."""
    model = simulator.model
    per_chunk = max(1, _CHUNK // (model.rows * model.columns * simulator.steps_per_frame))
    size = per_chunk * simulator.steps_per_frame
    return np.concatenate(
        [
            simulator.advance(
                hand.point[i : i + size], hand.depth_mm[i : i + size], hand.radius_mm[i : i + size]
            )
            for i in range(0, len(hand.point), size)
        ]
    )
