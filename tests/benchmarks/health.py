"""Does play go on when something is wrong? Fingers, drift, leads and plugs in mid-game.

    python -m tests.benchmarks.health [--seeds N] [--minutes M] [--only NAME] [--json]

A simulated hand plays on the virtual orb; the shipped bundle listens, on a virtual clock; the event
metric judges. What happens:

    healthy          nothing
    finger at start  a finger lies on the orb from the first frame for 10 s; play begins 2 s later
    ten-minute press a press of ten minutes after one of play; play goes on 3 s after it
    drift            an hour in which every step of drift is ten times as large as usual
    cut              each of the ten electrodes is cut after one minute, for good
    dead             each of five taxels stops to react after one minute
    unplugged        no frames at all for ten seconds, after one minute of play
"""

from collections.abc import Callable, Iterable
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.shared.event_metric import TAIL_S, Answer, Event, Score, judge
from controller.shared.protocol.messages import Contact
from controller.simulator.dome.faults import Fault
from controller.simulator.hand.performance import GESTURES
from controller.simulator.orb import PRESETS, OrbModel
from controller.simulator.virtual_orb import VirtualOrb
from tests.support.recordings import drifting, sound

from .results import Results, command_line, row

RATE_HZ: Final = 40.0
CHANGE_S: Final = 60.0  # when what happens happens
FINGER_S: Final = 10.0
PRESS_S: Final = 600.0
AWAY_S: Final = 10.0
HOUR_MIN: Final = 60.0
_DOMAIN: Final = 6  # a family of seeds of its own
_PAUSE_S: Final = (1.6, 2.8)
_FINGER: Final = Contact(1, 2.6, 1.7, 8.0, 7.0)

_BUNDLE = bundles.read(bundles.default_path())
_RECOGNIZER = Recognizer(_BUNDLE)


def play(
    model: OrbModel,
    seed: int,
    minutes: float,
    *,
    busy: Iterable[tuple[float, float]] = (),
    finger: tuple[float, float] | None = None,
    faults: Iterable[tuple[float, str]] = (),
    away: tuple[float, float] | None = None,
    since_s: float = 0.0,
) -> Score:
    """Play; `busy`: no hand, `finger`: it lies there, `away`: no frames, (from, to), seconds."""
    orb = VirtualOrb(seed, RATE_HZ, _DOMAIN, model)
    rng = np.random.default_rng([_DOMAIN, seed])
    pipeline = Pipeline(_BUNDLE.settings, _RECOGNIZER, _BUNDLE.mapping)
    pending, events, answers = sorted(faults), [], []
    rests = list(busy)
    if finger is not None:
        rests.append((finger[0] - 1.5, finger[1]))
    touches: list[tuple[float, tuple[Contact, ...]]] = []
    if finger is not None:
        touches = [(finger[0], (_FINGER,)), (finger[1], ())]
    next_s, number = 2.0, 0
    for frame in range(1, round(minutes * 60 * RATE_HZ) + 1):
        t_s = frame / RATE_HZ
        while pending and pending[0][0] <= t_s:
            orb.switch([Fault.parse(pending.pop(0)[1], model.rows, model.columns)])
        while touches and touches[0][0] <= t_s:
            at_s, contacts = touches.pop(0)
            orb.touch(contacts, at_s)
        if t_s >= next_s:
            if not any(begin <= t_s < end for begin, end in rests):
                label = str(rng.choice(GESTURES))
                centre = (model.columns - 1) / 2, (model.rows - 1) / 2
                spread = 1.6 if label == "press" else 0.0
                x, y = np.array(centre) + spread * rng.uniform(-1.0, 1.0, 2)
                orb.perform(number, label, float(x), float(y), t_s)
                number += 1
            next_s = t_s + float(rng.uniform(*_PAUSE_S)) + 1.0
        scan = orb.read(t_s)
        events += [
            Event(truth.onset_ms / 1000, truth.release_ms / 1000, truth.label)
            for truth in orb.truths()
        ]
        if away is not None and away[0] <= t_s < away[1]:
            continue
        step = pipeline.step(scan, t_s, frame)
        pipeline.check_health()
        if step.gesture is not None:
            answers.append(Answer(t_s, step.gesture))
    if finger is not None:
        events.append(Event(finger[0], finger[1], "press"))
    if away is not None:  # who plays on a dead orb is not heard
        events = [e for e in events if not away[0] - 0.5 <= e.release_s <= away[1] + 1.0]
    # What answers a gesture that began before counts as little as that gesture.
    old = max((e.release_s + TAIL_S for e in events if e.onset_s < since_s), default=0.0)
    events = sorted((e for e in events if e.onset_s >= since_s), key=lambda e: e.onset_s)
    first_s = min([old, *(e.onset_s for e in events)])
    answers = [a for a in answers if a.time_s >= max(since_s, first_s)]
    return judge(events, answers)


Scene = Callable[[OrbModel, int, float], Score]


def _finger(model: OrbModel, seed: int, minutes: float) -> Score:
    busy, finger = [(0.0, FINGER_S + 2.0)], (-1.0, FINGER_S)
    return play(model, seed, minutes, finger=finger, busy=busy, since_s=FINGER_S)


def _press(model: OrbModel, seed: int, minutes: float) -> Score:
    ends = CHANGE_S + PRESS_S
    return play(
        model, seed, minutes + PRESS_S / 60 + 1, finger=(CHANGE_S, ends),
        busy=[(CHANGE_S, ends + 3.0)], since_s=CHANGE_S,
    )  # fmt: skip


def _drift(model: OrbModel, seed: int, minutes: float) -> Score:
    return play(drifting(model, float(np.sqrt(10.0)), 10.0), seed, HOUR_MIN)


def _cut(lead: str) -> Scene:
    def run(model: OrbModel, seed: int, minutes: float) -> Score:
        return play(model, seed, 1 + minutes, faults=[(CHANGE_S, lead)], since_s=CHANGE_S)

    return run


def _unplugged(model: OrbModel, seed: int, minutes: float) -> Score:
    away = (CHANGE_S, CHANGE_S + AWAY_S)
    return play(model, seed, 1 + minutes, away=away, since_s=CHANGE_S)


def scenes(model: OrbModel) -> dict[str, Scene]:
    """Return what may happen, by name."""
    rows, columns = model.rows, model.columns
    cuts = [f"open_row:{i}" for i in range(rows)] + [f"open_column:{i}" for i in range(columns)]
    dead = [f"dead:{i},{i}" for i in range(min(rows, columns))]
    return {
        "healthy": play,
        "finger at start": _finger,
        "ten-minute press": _press,
        **{f"cut {lead}": _cut(lead) for lead in cuts},
        **{f"{taxel}": _cut(taxel) for taxel in dead},
        "unplugged": _unplugged,
        "drift": _drift,
    }


def main() -> None:
    parser = command_line(__doc__, seeds=4, minutes=3.0, only="")
    parser.add_argument("--preset", action="append", help="which orb (default: every one)")
    options = parser.parse_args()
    results = Results("health")
    for name in options.preset or PRESETS:
        model = sound(name)
        print(f"\n{name}: events, recall, F1, wrong, false alarms, twice; median latency")
        for scene, run in scenes(model).items():
            if not scene.startswith(options.only):
                continue
            score = Score()
            seeds = 1 if scene == "drift" else options.seeds
            for seed in range(seeds):
                score.add(run(model, seed, options.minutes))
            late = float(np.median(score.latencies_s)) if score.latencies_s else float("nan")
            print(
                f"{scene:<18}{score.intended:5d}  {score.recall:.3f}  {score.f1:.4f}"
                f"{score.wrong:4d}{score.false_alarms:4d}{score.duplicates:4d}  {late:.2f} s",
                flush=True,
            )
            goal = 0.95 if scene.startswith("cut") else 0.985 if scene.startswith("dead") else None
            results.rows.append(row(f"f1 {scene}", score.f1, "share", preset=name, goal=goal))
    results.finish(options.json)


if __name__ == "__main__":
    main()
