"""Healthy orbs that are called faulty, and dead taxels that are found in play.

    python -m tests.benchmarks.phantom [--orbs N] [--minutes M] [--taxels N] [--seed N] [--json]

Virtual orbs without a fault are clicked at three places, squeezed, and touched by one to five
fingers as on a phone; no sentence about a taxel may come. Then each taxel dies, and a player clicks
twice a second anywhere on the dome, with a pinch or twist in between; the seconds until the monitor
names the taxel are counted. In one process, by the device's stages, on a virtual clock.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.recognition.images.preprocess import Preprocessor
from controller.shared.aliases import Mask
from controller.shared.protocol.messages import Contact
from controller.simulator.dome.faults import Fault
from controller.simulator.orb import PRESETS, preset
from controller.simulator.virtual_orb import VirtualOrb

from .results import Results, command_line, say

RATE_HZ: Final = 40.0
DOMAIN: Final = 7  # a family of seeds of its own
DEPTH_MM, RADIUS_MM = 9.0, 7.0
FOUND_S: Final = 60.0  # until a dead taxel is found
CLICK_S: Final = {"nominal": (0.1, 0.3), "paper-snr": (0.3, 0.5)}
DOME: Final = 3.5  # radius on which a player clicks, grid units

Rng = np.random.Generator
Touch = tuple[float, tuple[Contact, ...]]  # seconds until it lifts, and its fingers


@dataclass
class Player:
    """Touches of one kind, drawn one after the other."""

    kind: str
    preset: str
    rng: Rng

    def touches(self) -> Iterator[Touch | str]:
        """Yield touches, or gestures of the orb's own hand."""
        sites = self.rng.uniform(0.0, 4.0, (3, 2))
        while True:
            if self.kind == "squeezes":
                yield "squeeze"
            elif self.kind == "clicks":
                yield self._click_s(), (_finger(0, *sites[self.rng.integers(3)]),)
            elif self.kind == "phone":
                count = int(self.rng.integers(1, 6))
                places = self.rng.uniform(-0.5, 4.5, (count, 2))
                yield 0.3, tuple(_finger(n, *place) for n, place in enumerate(places))
            elif self.rng.random() < 0.15:
                yield str(self.rng.choice(("pinch", "twist_cw", "twist_ccw")))
            else:
                angle, reach = self.rng.uniform(0, 2 * np.pi), DOME * np.sqrt(self.rng.random())
                place = 2 + reach * np.cos(angle), 2 + reach * np.sin(angle)
                yield self._click_s(), (_finger(0, *place),)

    def _click_s(self) -> float:
        return float(self.rng.uniform(*CLICK_S[self.preset]))


def _finger(number: int, x: float, y: float) -> Contact:
    return Contact(number, float(x), float(y), DEPTH_MM, RADIUS_MM)


PAUSE_S: Final = {"clicks": 0.4, "phone": 0.5, "squeezes": 2.5, "play": 0.3}


def play(
    name: str, kind: str, seed: int, seconds: float, dead: str, stop: Callable[[Mask], bool]
) -> float | None:
    """Return when `stop` first holds of the dead taxels found, seconds; None: never."""
    orb = VirtualOrb(seed, RATE_HZ, DOMAIN, preset(name))
    if dead:
        orb.switch([Fault.parse(dead, 5, 5)])
    rng = np.random.default_rng([DOMAIN, seed])
    touches = Player(kind, name, rng).touches()
    loaded = bundles.read(bundles.default_path())
    stage = Preprocessor(loaded.preprocess, 5, 5)
    next_s, lift_s, number = 2.0, np.inf, 0
    for frame in range(1, round(seconds * RATE_HZ) + 1):
        t_s = frame / RATE_HZ
        if t_s >= lift_s:
            orb.touch((), t_s)
            lift_s, next_s = np.inf, t_s + PAUSE_S[kind]
        if t_s >= next_s and lift_s == np.inf:
            touch = next(touches)
            if isinstance(touch, str):
                orb.perform(number, touch, 2.0, 2.0, t_s)
                number, next_s = number + 1, t_s + 2.5
            else:
                orb.touch(touch[1], t_s)
                lift_s = t_s + touch[0]
        found = stage.step(orb.read(t_s)).dead
        orb.truths()
        if found is not None and stop(found):
            return t_s
    return None


def found_at(row: int, column: int) -> Callable[[Mask], bool]:
    """Return a test of whether a taxel is among the dead ones."""
    return lambda dead: bool(dead[row, column])


def main() -> None:
    """Count phantom faults, and the seconds until dead taxels are found."""
    parser = command_line(__doc__, orbs=100, minutes=10.0, taxels=25, seed=1)
    options, results = parser.parse_args(), Results("phantom")
    for name in PRESETS:
        for kind in ("clicks", "squeezes", "phone"):
            wrong = 0
            for number in range(options.orbs):
                seed = 1000 * options.seed + number
                seconds = 60 * options.minutes
                wrong += play(name, kind, seed, seconds, "", lambda _: True) is not None
                if (number + 1) % 10 == 0:
                    say(f"{name}, {kind}: {wrong} of {number + 1} orbs")
            results.note(f"phantom_{kind}", wrong, f"of {options.orbs}", preset=name, goal=0)
        times = []
        for number, (row, column) in enumerate([*np.ndindex(5, 5)][: options.taxels]):
            seed = 1000 * options.seed + 500 + number
            time_s = play(
                name, "play", seed, 3 * FOUND_S, f"dead:{row},{column}", found_at(row, column)
            )
            times.append(3 * FOUND_S if time_s is None else time_s)
            say(f"{name}: dead at {row},{column}: {times[-1]:.0f} s")
        found = sum(time_s <= FOUND_S for time_s in times)
        results.note("dead_found_in_60_s", found, f"of {len(times)}", preset=name, goal=len(times))
        results.spread("dead_found_after_s", times, "s", preset=name)
    results.finish(options.json)


if __name__ == "__main__":
    main()
