"""Hands that no training drew: slides, resting hands, bumps, wind-up, trembling, lost pressure.

    python -m tests.benchmarks.unruly [--touches N] [--people N] [--seed N] [--hands A,B]
                                      [--physics SHARE] [--bundle FILE] [--json]

Each row is a kind of touch (`unruly_hands.py`) in a part of its strength's range, thirds for most.
People and orbs are of a family of seeds that no training uses, and each session draws the constants
of its dome within `--physics` of the model's. A touch is right if the expected gestures answer it
until half a second after the last finger has left, each once and in order. Shares of touches:

- `false`: answered, although nothing is expected, or before the first expected gesture;
- `wrong`: another gesture answered in place of an expected one, or beside it, or a press was placed
  more than a grid unit from where its finger landed;
- `missed`: an expected gesture did not come;
- `twice`: an expected gesture came more than once.

`light_set` has the touches of `light`, with the touch strength found from each person's first five.

`place` is the median distance of a press's place from where its finger landed, grid units.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass, field, replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from controller.adapt import lessons
from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.images.preprocess import Preprocessor
from controller.recognition.pipeline import Pipeline
from controller.shared import touch_strength
from controller.shared.aliases import Frames
from controller.simulator.dome.faults import Fault
from controller.simulator.dome.mechanics import MechanicsModel
from controller.simulator.hand.performance import SLOTS
from controller.simulator.orb import PRESETS, OrbSimulator, preset

from .results import Results, command_line, say
from .unruly_hands import HANDS, Expected, Person, Rng, Touch

RATE_HZ: Final = 40.0
DOMAIN: Final = 8  # a family of seeds of its own
LEAD_S: Final = 3.0  # the rest image is found
PAUSE_S: Final = (0.9, 1.6)  # from one touch to the next
SLOW_PAUSE_S: Final = (2.2, 3.2)  # where a session is to last: 15 touches in 50 s
LATE_S: Final = 0.5  # after the last finger has left, in which an answer still belongs to a touch
PITCH_MM: Final = 10.0
MIDDLE: Final = 2.0  # grid units
FAR: Final = 1.0  # grid units; a command's region is 1.3 wide and more

# Bounds of the parts of the strength
THIRDS: Final = (1 / 3, 2 / 3)
BOUNDS: Final = {"wind_up": (0.5,), "light": (1 / 6, 0.5), "short": (0.5,)}
Goals = tuple[float | None, ...]
# Share of touches that is to be right, by part of the strength, on each preset
RIGHT: Final[dict[str, tuple[Goals, Goals]]] = {
    "wind_up": ((0.98, 0.9), (0.95, 0.85)),
    "off_middle": ((0.95,) * 3, (0.9,) * 3),
    "light": ((None, None, 0.97), (None, None, 0.9)),
    "light_set": ((None, 0.97, 0.97), (None, 0.9, 0.9)),
    "trembling": ((0.97,) * 3, (0.97,) * 3),
    "press_in_pinch": ((0.95,) * 3, (0.85,) * 3),
    "losing_air": ((0.97,) * 3, (0.95,) * 3),
    "short": ((0.9, 0.99), (None, None)),
}
# Share of touches that may be answered falsely or wrongly, on each preset
HARMLESS: Final = ("slide", "spread", "rest", "bump", "thumb", "lean", "two_at_once")
FALSE: Final = (0.01, 0.03)


class Answer(NamedTuple):
    """A gesture that fired, from the begin of its touch."""

    time_s: float
    label: str
    place: tuple[float, float] | None  # grid units


class Placed(NamedTuple):
    """A touch of a session."""

    begin_s: float
    end_s: float
    strength: float
    touch: Touch


@dataclass(slots=True)
class Tally:
    """Outcomes of touches of one part of the strength."""

    touches: int = 0
    right: int = 0
    false: int = 0
    wrong: int = 0
    missed: int = 0
    twice: int = 0
    false_or_wrong: int = 0
    places: list[float] = field(default_factory=list)

    def add(self, touch: Touch, answers: Sequence[Answer]) -> None:
        """Count a touch that these answered."""
        begins = [one.at_s for one in touch.expected]
        owners = np.searchsorted(begins, [one.time_s for one in answers], side="right") - 1
        early = tuple(a.label for a, owner in zip(answers, owners, strict=True) if owner < 0)
        false, wrong, missed, twice = early not in ((), touch.optional), False, False, False
        for number, expected in enumerate(touch.expected):
            own = [a for a, owner in zip(answers, owners, strict=True) if owner == number]
            labels = [one.label for one in own]
            missed |= expected.label not in labels
            twice |= labels.count(expected.label) > 1
            distances = _distances(expected, own)
            wrong |= any(label != expected.label for label in labels)
            wrong |= any(distance > FAR for distance in distances)
            self.places += distances
        self.touches += 1
        self.right += not (false or wrong or missed or twice)
        self.false += false
        self.wrong += wrong
        self.missed += missed
        self.twice += twice
        self.false_or_wrong += false or wrong


def _distances(expected: Expected, answers: Sequence[Answer]) -> list[float]:
    """Return how far the places of right answers are from where the finger landed, grid units."""
    if expected.point is None:
        return []
    wanted = expected.point / PITCH_MM + complex(MIDDLE, MIDDLE)
    named = (one.place for one in answers if one.label == expected.label)
    return [abs(complex(*place) - wanted) for place in named if place is not None]


def physics(model: MechanicsModel, within: float, rng: Rng) -> MechanicsModel:
    """Return a dome whose constants are drawn within a share of a model's, each by itself."""

    def drawn(value: float) -> float:
        return value * float(rng.uniform(1.0 - within, 1.0 + within))

    contact, friction = model.contact, drawn(1.0)
    return replace(
        model,
        apex_stretch=1.0 + drawn(model.apex_stretch - 1.0),
        contact=replace(
            contact,
            bulge=drawn(contact.bulge),
            permittivity_drop=drawn(contact.permittivity_drop),
            stick=drawn(contact.stick),
            spread=drawn(contact.spread),
            wrap=drawn(contact.wrap),
            reach=drawn(contact.reach),
        ),
        friction=(friction * model.friction[0], friction * model.friction[1]),
        memory=tuple((drawn(share), drawn(tau_s)) for share, tau_s in model.memory),
    )


def session(
    hand: str, name: str, seed: int, number: int, count: int, within: float
) -> tuple[Frames, list[Placed]]:
    """Return the frames of one person on one orb, and the touches."""
    rng = np.random.default_rng([DOMAIN, seed, number, list(HANDS).index(hand)])
    person, placed, now = Person.draw(rng), [], LEAD_S
    for touched in range(count):
        strength = (touched + 0.5) / count if hand == "losing_air" else rng.uniform()
        touch = HANDS[hand](person, rng, strength)
        end = now + max(finger.t_s[-1] for finger in touch.fingers)
        placed.append(Placed(now, end, strength, touch))
        now = end + rng.uniform(*(SLOW_PAUSE_S if hand == "losing_air" else PAUSE_S))
    model, dome = preset(name), np.random.default_rng([DOMAIN, seed, number, len(HANDS)])
    model = replace(model, mechanics=physics(model.mechanics, within, dome))
    simulator = OrbSimulator(np.random.SeedSequence([DOMAIN, seed, number]), RATE_HZ, model=model)
    if hand == "losing_air":
        simulator.electronics.switch([Fault.parse("air_leak=0.24")])  # of its pressure, a minute
    step_hz = RATE_HZ * simulator.steps_per_frame
    steps = int(now * RATE_HZ + RATE_HZ) * simulator.steps_per_frame
    time_s = np.arange(steps) / step_hz
    point = np.zeros((steps, SLOTS), dtype=np.complex128)
    depth, radius = np.zeros((steps, SLOTS)), np.full((steps, SLOTS), 7.0)
    for begin, end, _, touch in placed:
        part = slice(round(begin * step_hz), round(end * step_hz) + 2)
        for slot, finger in enumerate(touch.fingers):
            point[part, slot], depth[part, slot] = finger.track(time_s[part] - begin)
            radius[part, slot] = finger.radius_mm
    return simulator.advance(point, depth, radius), placed


def answered(loaded: Bundle, frames: Frames) -> list[Answer]:
    """Return the gestures that fire in frames, (n, rows, columns), from the first frame's begin."""
    pipeline, answers = Pipeline(loaded.settings, Recognizer(loaded), loaded.mapping), []
    for number, frame in enumerate(frames, 1):
        step = pipeline.step(np.asarray(frame, dtype=np.float32), number / RATE_HZ)
        if step.gesture is not None:
            answers.append(Answer(step.t_s, step.gesture, step.touch))
    return answers


def usual_press(path: Path) -> float:
    """Return the mean |z - 1| of a press of a bundle's training."""
    known = lessons.read(path.read_bytes())
    assert known.rehearsal is not None
    firmest = lessons.from_bytes(known.rehearsal.firmest)[known.trained.index("press")]
    return abs(float(firmest.mean()) - 1.0)


def strengthened(loaded: Bundle, frames: Frames, usual: float) -> Bundle:
    """Return a bundle with the touch strength that the first presses in frames show."""
    stage = Preprocessor(loaded.preprocess, *frames.shape[1:])
    steps = [stage.step(np.asarray(frame, dtype=np.float32)) for frame in frames]
    means = [float(step.image.mean()) - 1.0 for step in steps if step.ready]
    presses = touch_strength.press_deviations(means, RATE_HZ)[: touch_strength.PRESSES]
    strength = touch_strength.of_presses(presses, usual) if presses else 1.0
    return replace(loaded, strength=strength)


def measure(
    loaded: Bundle,
    hand: str,
    name: str,
    seed: int,
    people: int,
    count: int,
    within: float,
    usual: float = 0.0,
) -> list[Tally]:
    """Return the tallies of the parts of the strength.

    With the `usual` deviation of a press, the touch strength of each person is set.
    """
    bounds = BOUNDS.get(hand, THIRDS)
    tallies = [Tally() for _ in range(len(bounds) + 1)]
    for number in range(people):
        frames, placed = session(hand, name, seed, number, count, within)
        answers = answered(strengthened(loaded, frames, usual) if usual else loaded, frames)
        for begin_s, end_s, strength, touch in placed:
            until_s = end_s + LATE_S
            own = [
                one._replace(time_s=one.time_s - begin_s)
                for one in answers
                if begin_s <= one.time_s < until_s
            ]
            tallies[int(np.searchsorted(bounds, strength))].add(touch, own)
    return tallies


def main() -> None:
    """Print, for each hand and part of its strength, the shares of outcomes."""
    parser = command_line(
        __doc__, touches=15, people=8, seed=1, hands="", physics=0.2, bundle=Path()
    )
    options, results = parser.parse_args(), Results("unruly")
    path = bundles.default_path() if options.bundle == Path() else options.bundle
    loaded, size = bundles.read(path), (options.seed, options.people, options.touches)
    hands = options.hands.split(",") if options.hands else list(HANDS)
    if "light" in hands:
        hands.insert(hands.index("light") + 1, "light_set")
    for column, name in enumerate(PRESETS):
        for hand in hands:
            goals = RIGHT[hand][column] if hand in RIGHT else (None,) * 3
            usual = usual_press(path) if hand == "light_set" else 0.0
            touched = hand.removesuffix("_set")  # the same touches
            parts = measure(loaded, touched, name, *size, options.physics, usual)
            for part, tally in enumerate(parts):
                row, touches = f"{hand}_{part + 1}", max(1, tally.touches)
                *counts, places = astuple(tally)[1:]
                names = ("right", "false", "wrong", "missed", "twice", "false_or_wrong")
                shares = dict(zip(names, (one / touches for one in counts), strict=True))
                place = float(np.median(places)) if places else None
                columns = ", ".join(f"{key} {shares[key]:.3f}" for key in names[1:5])
                say(f"{name} {row}: {columns}" + ("" if place is None else f", place {place:.3f}"))
                value = shares.pop("right")
                more = {"touches": tally.touches, "place": place, **shares}
                results.note(row, value, "1", preset=name, goal=goals[part], **more)
                if hand in HARMLESS:
                    harm = shares["false_or_wrong"]
                    results.note(f"{row}_harm", harm, "1", preset=name, goal=FALSE[column])
    results.finish(options.json, bundle=str(path))


if __name__ == "__main__":
    main()
