"""Two commands in quick succession: which pairs are both understood, by gap.

    python -m tests.benchmarks.transitions [--touches N] [--hands A,B] [--preset NAME]
                                           [--bundle FILE] [--json]

A cell is an ordered pair of the game's commands and a gap: the time from the last finger's leaving
to the next one's first contact. `--touches` people, each on an orb of their own, make every pair
at every gap once: calmly ("hand"), as in fast play ("quick"), or with a pointer ("pointer").
People, orbs and seeds are of a family that no training uses. A pair counts if its two commands
answer it, in order, and nothing else does until half a second after the last finger has left.
Rows pool the pairs of a gap, and below those of two gestures.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.inference.networks import Recognizer
from controller.recognition.pipeline import Pipeline
from controller.shared.aliases import Frames
from controller.simulator.hand.performance import SLOTS, perform
from controller.simulator.hand.user_style import draw_mood, draw_style
from controller.simulator.orb import PRESETS, OrbSimulator, preset

from .results import Results, command_line, say

RATE_HZ: Final = 40.0
DOMAIN: Final = 9  # a family of seeds of its own
HANDS: Final = ("hand", "quick", "pointer")
GAPS_S: Final = (0.1, 0.15, 0.25, 0.5)
LEAD_S: Final = 3.0  # the rest image is found
PAUSE_S: Final = (1.0, 1.6)  # from one pair to the next
LATE_S: Final = 0.5  # after the last finger has left, in which an answer still belongs to a pair
TOUCHING_MM: Final = 0.05  # shallower than this no finger touches
MIDDLE: Final = (2.0, 2.0)
# command -> gesture and place, grid units
COMMANDS: Final = {
    "left": ("press", (0.8, 2.7)),
    "right": ("press", (3.2, 2.7)),
    "down": ("press", (2.0, 0.5)),
    "drop": ("pinch", MIDDLE),
    "rotate_cw": ("twist", MIDDLE),
    "rotate_ccw": ("twist", MIDDLE),
}
TWISTS: Final = {"rotate_cw": "twist_cw", "rotate_ccw": "twist_ccw"}
GESTURES: Final = ("press", "pinch", "twist")
# Share of a gap's pairs that is to be understood, on each preset
GOALS: Final = {
    "nominal": {0.1: 0.9, 0.15: 0.98, 0.25: 0.98, 0.5: 0.98},
    "paper-snr": {0.25: 0.93, 0.5: 0.93},
}


@dataclass(frozen=True, slots=True)
class Pair:
    """Two touches of a session.

    Attributes:
        commands: What shall answer them, in order.
        gap_s: From the last finger's leaving to the next one's first contact.
        begin_s: First contact of the first touch.
        end_s: The last finger of the second one has left.
    """

    commands: tuple[str, str]
    gap_s: float
    begin_s: float
    end_s: float

    @property
    def gestures(self) -> tuple[str, str]:
        """The gestures behind the commands."""
        first, second = self.commands
        return COMMANDS[first][0], COMMANDS[second][0]


def session(hand: str, name: str, number: int) -> tuple[Frames, list[Pair]]:
    """Return the frames of one person on one orb of a preset, and the pairs that they made."""
    orb, person = np.random.SeedSequence([DOMAIN, HANDS.index(hand), number]).spawn(2)
    rng = np.random.default_rng(person)
    style = replace(draw_mood(draw_style(rng), rng), pointer=hand == "pointer")
    simulator = OrbSimulator(orb, RATE_HZ, model=preset(name))
    step_hz = RATE_HZ * simulator.steps_per_frame
    cells = list(itertools.product(COMMANDS, COMMANDS, GAPS_S))
    parts, pairs, step = [], [], round(LEAD_S * step_hz)  # first step of each touch, and its paths
    for first, second, gap_s in (cells[i] for i in rng.permutation(len(cells))):
        begins = []
        for command, wait_s in ((first, rng.uniform(*PAUSE_S)), (second, gap_s)):
            gesture, place = COMMANDS[command]
            label = TWISTS.get(command, gesture)
            paths = perform(label, place, style, rng, step_hz=step_hz, quick=hand != "hand")
            touching = np.flatnonzero((paths.depth_mm > TOUCHING_MM).any(axis=1))
            begins.append(step + round(wait_s * step_hz))
            parts.append((begins[-1] - int(touching[0]), paths))
            step = begins[-1] + int(touching[-1] - touching[0]) + 1
        pairs.append(Pair((first, second), gap_s, begins[0] / step_hz, step / step_hz))
    steps = round((step / step_hz + 1.0) * RATE_HZ) * simulator.steps_per_frame
    point = np.zeros((steps, SLOTS), dtype=np.complex128)
    depth, radius = np.zeros((steps, SLOTS)), np.full((steps, SLOTS), 7.0)
    for begin, paths in parts:
        of, here = slice(begin, begin + len(paths.point)), paths.depth_mm > TOUCHING_MM
        point[of][here], depth[of][here] = paths.point[here], paths.depth_mm[here]
        radius[of] = np.where(here, paths.radius_mm, radius[of])
    return simulator.advance(point, depth, radius), pairs


def understood(bundle: Bundle, frames: Frames, pairs: list[Pair]) -> Iterator[tuple[Pair, bool]]:
    """Yield each pair, and whether its two commands answer it, in order, and no other does."""
    pipeline = Pipeline(bundle.settings, Recognizer(bundle), bundle.mapping)
    answers = []
    for number, frame in enumerate(frames, 1):
        step = pipeline.step(np.asarray(frame, dtype=np.float32), number / RATE_HZ)
        if step.command is not None:
            answers.append((step.t_s, step.command.command))
    for pair in pairs:
        until_s = pair.end_s + LATE_S
        own = tuple(name for t_s, name in answers if pair.begin_s <= t_s < until_s)
        yield pair, own == pair.commands


def main() -> None:
    """Print the share of pairs understood, for each hand and gap."""
    parser = command_line(__doc__, touches=10, hands=",".join(HANDS), preset="", bundle=Path())
    options, results = parser.parse_args(), Results("transitions")
    path = bundles.default_path() if options.bundle == Path() else options.bundle
    loaded = bundles.read(path)
    for name in [options.preset] if options.preset else PRESETS:
        for hand in options.hands.split(","):
            outcomes: list[tuple[Pair, bool]] = []
            for number in range(options.touches):
                outcomes += understood(loaded, *session(hand, name, number))
                say(f"{name}: {hand} {number + 1} of {options.touches}")
            for gap_s in GAPS_S:
                at_gap = [(pair.gestures, right) for pair, right in outcomes if pair.gap_s == gap_s]
                of_gap = {"preset": name, "hand": hand, "gap_s": gap_s}
                label, goal = f"{hand}_{gap_s * 1000:.0f}ms", GOALS[name].get(gap_s)
                share = float(np.mean([right for _, right in at_gap]))
                results.note(label, share, "1", goal=goal, touches=len(at_gap), **of_gap)
                for both in itertools.product(GESTURES, GESTURES):
                    rights = [right for gestures, right in at_gap if gestures == both]
                    share = float(np.mean(rights))
                    pair_name = f"  {label}_{both[0]}_{both[1]}"
                    results.note(pair_name, share, "1", touches=len(rights), **of_gap)
    results.finish(options.json, bundle=str(path))


if __name__ == "__main__":
    main()
