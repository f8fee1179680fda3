"""Examples and their variations against earlier ones: no span, weight or noise changes unnoticed.

When a change is meant to change them, `python -m tests.controller.adapt.test_golden` writes them
anew.
"""

from pathlib import Path

import numpy as np

from controller.adapt.examples import Example, touched, varied, vary
from tests.support.golden import Answers, compare

GOLDEN = Path(__file__).with_name("golden.npz")
TOUCHES = {
    "press": ((9.0, 14.0),),
    "double_tap": ((6.0, 9.0), (11.5, 14.0)),
    "swipe": ((4.0, 18.0),),
}


def images(touches: tuple[tuple[float, float], ...], rows: int, columns: int) -> np.ndarray:
    """Thirty frames of a finger that comes, wanders and goes, with some noise."""
    at, rng = np.arange(30.0)[:, None, None], np.random.default_rng(3)
    row, column = np.mgrid[:rows, :columns]
    z = 1.0 + 0.002 * rng.normal(size=(30, rows, columns))
    for begin, end in touches:
        depth = np.clip(np.minimum(at - begin, end - at) + 0.4, 0.0, 1.0)
        x = 1.0 + 2.0 * (at - begin) / (end - begin)
        z -= 0.3 * depth * np.exp(-((column - x) ** 2 + (row - 1.5) ** 2) / 2.0)
    return z.astype(np.float32)


def answers() -> Answers:
    """What is found in each example, and a few numbers of what is made of it."""
    made: Answers = {}
    for name, touches in TOUCHES.items():
        for rows, columns in ((5, 5), (4, 6)):
            frames = images(touches, rows, columns)
            key = f"{name}-{rows}x{columns}"
            spans = [(*one.span, one.quiet) for one in touched(frames, 10.0)]
            one = Example(name, frames, rotations="all", mirrored=True).found(10.0)
            assert one is not None
            made[f"{key}-touches"], made[f"{key}-span"] = np.array(spans), np.array(one.span)
            made[f"{key}-noise"] = np.array([one.noise(), len(one.images)])
            for window in (4, 25):
                windows, weights = vary(one, window, 6, np.random.default_rng(window))
                made[f"{key}-{window}-weights"] = weights
                made[f"{key}-{window}-windows"] = windows.reshape(len(windows), window, -1)[
                    ::7, :, ::9
                ]
            rng = np.random.default_rng(5)
            many = np.concatenate([each.images for each in varied(one, 4, rng)])
            made[f"{key}-varied"] = many.reshape(len(many), -1)[::5, ::7]
    return {key: array.astype(np.float32) for key, array in made.items()}


def test_examples_are_found_and_varied_as_before() -> None:
    compare(GOLDEN, answers())


if __name__ == "__main__":
    np.savez_compressed(GOLDEN, allow_pickle=False, **answers())
