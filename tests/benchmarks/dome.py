"""Clicks and drags anywhere on the lit dome: is what follows what the dome shows?

    python -m tests.benchmarks.dome [--preset NAME] [--bundle FILE] [--clicks N] [--drags N]
    python -m tests.benchmarks.dome --pointer N   # a real pointer on the window, under Xvfb
    python -m tests.benchmarks.dome --phone N     # fingers on the phone's page, in Chromium

Places are even over the lit area. Clicks and drags go through the panel's own input code
(`host.ui.pointer_input`) to a virtual orb and the recognition pipeline in one process, at
the link's times: contacts sixty times a second, frames as the bundle has them.
A click is right if exactly one command follows, that of the zone. Nearer than MARGIN to another
zone either is right, and these clicks are counted apart. `ring` is outside the square of taxels,
`corner` the rest of what is farther from the centre than the taxels on the axes.

Drags go round the rim, or straight from anywhere; with as many right clicks. Straight ones that
follow the rim for long enough begin as a turn does; they are counted apart. A hand begins to move
at most 0.1 s after its button, and speeds up and slows down gently (minimum jerk).
"""

import math
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.inference.networks import Recognizer
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import Pipeline
from controller.shared.event_metric import Answer
from controller.shared.protocol.messages import Contacts
from controller.simulator.orb import preset as model_of
from controller.simulator.virtual_orb import VirtualOrb
from host.ui.pointer_input import DomeArea, PointerInput

from .results import Results, command_line, say
from .tapping import READY_S, TICK_S

Point = tuple[float, float]
PAD: Final = DomeArea()
LIT: Final = 0.94 * PAD.radius  # as host/ui/zones.py draws it
SIDE: Final = 2.55  # grid units from the centre to the sides of the square of taxels
MARGIN: Final = {"nominal": 0.15, "paper-snr": 0.45}  # grid units; three position errors
DWELL_S: Final = {"nominal": (0.08, 0.3), "paper-snr": (0.3, 0.5)}
GOAL: Final = {"nominal": 0.99, "paper-snr": 0.85}
PART_GOAL: Final = {"nominal": 0.98, "paper-snr": None}  # of ring and corners, each
RIGHT_S: Final = (0.03, 0.3)  # of a click with the right button
ANSWER_S: Final = 0.9  # after the button is up
ORBS: Final = 5
SEED: Final = 971_466


@dataclass(slots=True)
class Tally:
    """What followed touches of one kind."""

    outcomes: Counter[str] = field(default_factory=Counter)
    latencies_s: list[float] = field(default_factory=list)

    def row(self) -> dict[str, int]:
        """Return the counts of what went wrong."""
        return {"touches": self.outcomes.total(), **dict(self.outcomes)}

    @property
    def right(self) -> float | None:
        """The share that is right."""
        total = self.outcomes.total()
        return self.outcomes["right"] / total if total else None


Tallies = dict[str, Tally]


def lit_place(rng: np.random.Generator) -> Point:
    """Return a place, evenly drawn from the lit area."""
    away, angle = LIT * math.sqrt(rng.uniform()), rng.uniform(0.0, math.tau)
    return PAD.centre[0] + away * math.cos(angle), PAD.centre[1] + away * math.sin(angle)


def part_of(place: Point) -> str:
    """Return the part of the dome that a place is in."""
    across, up = (abs(a - b) for a, b in zip(place, PAD.centre, strict=True))
    if max(across, up) > SIDE:
        return "ring"
    return "corner" if PAD.distance(*place) > SIDE else "middle"


def allowed(mapping: Mapping, place: Point, margin: float) -> set[str]:
    """Return the commands of a press at a place, and of those within a margin."""
    turns = np.linspace(0.0, math.tau, 33)
    around = [(margin * math.cos(one), margin * math.sin(one)) for one in turns]
    places = [place, *((place[0] + x, place[1] + y) for x, y in around)]
    return {str(mapping.command("press", one)) for one in places}


def outcome(wanted: set[str], got: list[str]) -> str:
    """Return "right", or what went wrong."""
    if len(got) == 1:
        turned = got[0].startswith("rotate")
        other = "turned" if turned else "dropped" if got[0] == "drop" else "other_zone"
        return "right" if got[0] in wanted else other
    return "twice" if got else "nothing"


class Orb:
    """A virtual orb and its recognition, whose time is granted tick by tick."""

    def __init__(self, seed: int, preset: str, bundle: bundles.Bundle) -> None:
        self._rate_hz = bundle.rate_hz
        self._orb = VirtualOrb(seed, bundle.rate_hz, model=model_of(preset))
        self._pipeline = Pipeline(bundle.settings, Recognizer(bundle), bundle.mapping)
        self._frames, self.now_s = 0, 0.0
        self.commands: list[Answer] = []
        while self.now_s < READY_S:
            self.step(None)

    def step(self, message: Contacts | None) -> None:
        """Take a message, pass a tick, and keep its commands."""
        if message is not None:
            self._orb.touch(message.contacts, self.now_s)
        self.now_s += TICK_S
        while (self._frames + 1) / self._rate_hz <= self.now_s + 1e-9:
            self._frames += 1
            at_s = self._frames / self._rate_hz
            done = self._pipeline.step(self._orb.read(at_s), at_s, self._frames)
            self._pipeline.check_health()
            if done.command is not None:
                self.commands.append(Answer(self.now_s, done.command.command))


def stroke(
    orb: Orb, way: Callable[[float], Point], seconds: float, *, pinch: bool = False
) -> tuple[list[str], float]:
    """Hold the button along a way over time; return the commands, and the first's latency."""
    touch, before, begun_s = PointerInput(PAD), len(orb.commands), orb.now_s
    touch.press(*way(0.0), begun_s, pinch=pinch)
    while orb.now_s + TICK_S / 2 < begun_s + seconds:
        touch.move(*way(orb.now_s - begun_s))
        orb.step(touch.update(orb.now_s))
    touch.release()
    while orb.now_s < begun_s + seconds + ANSWER_S:
        orb.step(touch.update(orb.now_s))
    answers = orb.commands[before:]
    return [one.kind for one in answers], answers[0].time_s - begun_s if answers else math.nan


def pinch(orb: Orb, rng: np.random.Generator, to: Tallies) -> None:
    """Click with the right button anywhere, and count."""
    place = lit_place(rng)
    got, latency_s = stroke(orb, lambda _: place, rng.uniform(*RIGHT_S), pinch=True)
    to["pinch"].outcomes[outcome({"drop"}, got)] += 1
    to["pinch"].latencies_s.append(latency_s)


def click(orb: Orb, mapping: Mapping, preset: str, rng: np.random.Generator, to: Tallies) -> None:
    """Click anywhere, and count."""
    place = lit_place(rng)
    wanted = allowed(mapping, place, MARGIN[preset])
    got, latency_s = stroke(orb, lambda _: place, rng.uniform(*DWELL_S[preset]))
    kinds = ["click", part_of(place)] if len(wanted) == 1 else ["boundary"]
    for kind in kinds:
        to[kind].outcomes[outcome(wanted, got)] += 1
        to[kind].latencies_s.append(latency_s)


def eased(share: float) -> float:
    """Return the share of the way that a hand has gone after a share of the time."""
    share = min(1.0, max(0.0, share))
    return share**3 * (10.0 - 15.0 * share + 6.0 * share * share)


def go_round(orb: Orb, rng: np.random.Generator, to: Tallies) -> None:
    """Go round the rim, and count."""
    angle, sign = rng.uniform(0.0, math.tau), float(rng.choice([-1.0, 1.0]))
    away, turn = rng.uniform(3.05, LIT), math.radians(rng.uniform(45.0, 140.0))
    drift, wait_s, last_s = rng.normal(0.0, 0.1), rng.uniform(0.0, 0.1), rng.uniform(0.35, 1.0)

    def way(at_s: float) -> Point:
        share = eased((at_s - wait_s) / last_s)
        now, reach = angle + sign * turn * share, away + drift * share
        return PAD.centre[0] + reach * math.cos(now), PAD.centre[1] + reach * math.sin(now)

    got, latency_s = stroke(orb, way, wait_s + last_s + 0.05)
    to["round"].outcomes[outcome({"rotate_cw" if sign < 0 else "rotate_ccw"}, got)] += 1
    to["round"].latencies_s.append(latency_s)


def straight(
    orb: Orb, mapping: Mapping, preset: str, rng: np.random.Generator, to: Tallies
) -> None:
    """Drag straight from anywhere, and count."""
    x, y = lit_place(rng)
    angle, length = rng.uniform(0.0, math.tau), rng.uniform(0.5, 3.0)
    wait_s, last_s = rng.uniform(0.0, 0.1), rng.uniform(0.2, 0.8)

    def way(at_s: float) -> Point:
        gone = length * eased((at_s - wait_s) / last_s)
        return x + gone * math.cos(angle), y + gone * math.sin(angle)

    got, latency_s = stroke(orb, way, wait_s + last_s + 0.05)
    kind = "along_rim" if follows_rim((x, y), angle, length) else "straight"
    wanted = allowed(mapping, (x, y), MARGIN[preset])
    to[kind].outcomes["right" if not got else outcome(wanted, got)] += 1
    to[kind].latencies_s.append(latency_s)


def follows_rim(place: Point, angle: float, length: float) -> bool:
    """Whether a straight drag goes round for six degrees before it leaves the rim, at a slant."""
    across, up = place[0] - PAD.centre[0], place[1] - PAD.centre[1]
    away, from_centre = math.hypot(across, up), math.atan2(up, across)
    along = abs(math.sin(angle - from_centre))  # 1: at right angles to the way out
    far_enough = length * along > away * math.radians(6.0)
    return away > SIDE and along > math.cos(math.radians(40.0)) and far_enough


def measured(preset: str, path: Path, clicks: int, drags: int) -> Tallies:
    """Return what followed in virtual time, by kind of touch."""
    bundle = bundles.read(path)
    mapping = bundle.mapping
    names = (
        "click",
        "ring",
        "corner",
        "middle",
        "boundary",
        "round",
        "straight",
        "along_rim",
        "pinch",
    )
    found = {name: Tally() for name in names}
    for number in range(ORBS):
        rng = np.random.default_rng([SEED, number])
        orb = Orb(SEED + number, preset, bundle)
        for _ in range(clicks // ORBS):
            click(orb, mapping, preset, rng, found)
        for _ in range(drags // ORBS // 2):
            go_round(orb, rng, found)
            straight(orb, mapping, preset, rng, found)
            pinch(orb, rng, found)
        say(f"{preset}: orb {number + 1} of {ORBS}")
    return found


def by_pointer(touches: int) -> Iterator[tuple[Point, list[str]]]:
    """Yield places, and the commands of clicks there on the real window, under Xvfb."""
    from tests.support.x_programs import xvfb
    from tests.system.desktop import Desk

    rng = np.random.default_rng([SEED, 1])
    with ExitStack() as stack:
        home = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        display = stack.enter_context(xvfb(1280, 720))
        window = Desk(display, home, stack).open()
        time.sleep(1.0)
        for _ in range(touches):
            place, dwell_s = lit_place(rng), rng.uniform(*DWELL_S["nominal"])
            share = [(a - b) / PAD.radius for a, b in zip(place, PAD.centre, strict=True)]
            before = len(window.shown["commands"])
            window.press(share[0], share[1], dwell_s)
            time.sleep(ANSWER_S)
            yield place, window.shown["commands"][before:]


def by_phone(touches: int) -> Iterator[tuple[Point, list[str]]]:
    """Yield places, and the commands of touches there on the phone's page."""
    from tests.host.phone.test_phone_page import at, playing

    rng = np.random.default_rng([SEED, 2])
    with playing() as play:
        for _ in range(touches):
            place, dwell_s = lit_place(rng), rng.uniform(*DWELL_S["nominal"])
            share = [(a - b) / PAD.radius for a, b in zip(place, PAD.centre, strict=True)]
            yield place, [name for name, _ in play.stroke([[at(*share)]], dwell_s)]


def main() -> None:
    """Print the share of touches that do what the dome shows."""
    parser = command_line(
        __doc__,
        preset="",
        bundle=bundles.default_path(),
        clicks=1000,
        drags=200,
        pointer=0,
        phone=0,
    )
    arguments = parser.parse_args()
    results = Results("dome")
    for source, touches in ((by_pointer, arguments.pointer), (by_phone, arguments.phone)):
        if touches:
            real(results, source.__name__, source(touches))
    if not (arguments.pointer or arguments.phone):
        for preset in [arguments.preset] if arguments.preset else list(GOAL):
            show(
                results,
                preset,
                measured(preset, arguments.bundle, arguments.clicks, arguments.drags),
            )
    results.finish(arguments.json)


def real(results: Results, name: str, made: Iterator[tuple[Point, list[str]]]) -> None:
    """Print and keep what touches in real time did."""
    mapping, tally = bundles.read(bundles.default_path()).mapping, Tally()
    for number, (place, got) in enumerate(made, 1):
        wanted = allowed(mapping, place, MARGIN["nominal"])
        found = outcome(wanted, got)
        tally.outcomes[found] += 1
        if found != "right":
            say(f"{name}: ({place[0]:.2f}, {place[1]:.2f}) {part_of(place)}: {got}, not {wanted}")
        if number % 20 == 0:
            say(f"{name}: {number} touches")
    results.note(name, tally.right, "1", preset="nominal", goal=GOAL["nominal"], **tally.row())


def show(results: Results, preset: str, found: Tallies) -> None:
    """Print and keep the shares of one preset."""
    goals = {
        "click": GOAL[preset], "ring": PART_GOAL[preset], "corner": PART_GOAL[preset],
        "boundary": GOAL[preset], "round": GOAL[preset], "pinch": GOAL[preset],
    }  # fmt: skip
    for name, tally in found.items():
        known = [one for one in tally.latencies_s if not math.isnan(one)]
        median = float(np.median(known)) if known else None
        more = {"preset": preset, "goal": goals.get(name), "latency_s": median, **tally.row()}
        results.note(f"{name}_as_shown", tally.right, "1", **more)
    for name in ("click", "boundary", "straight"):
        turned = found[name].outcomes["turned"]
        results.note(f"{name}_turned", turned, "", preset=preset, goal=0.0)


if __name__ == "__main__":
    main()
