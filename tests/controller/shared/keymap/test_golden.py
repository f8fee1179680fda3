"""Held keys against earlier ones: no press, release or time changes unnoticed.

Commands, states and pauses are drawn; the digest is that of all strokes, notes and due times. When
a change is meant to change them, take the new digests from the failures.
"""

from hashlib import sha256
from random import Random

import pytest

from controller.shared.keymap.key_state import KeyState
from tests.controller.shared.keymap.test_key_state import MAP

GOLDEN = {0.0: "9d4a99a0bd01d61d", 0.03: "22fe32e88126a5ad"}
COMMANDS = (*MAP.profiles["game"], "unknown")


def digest(gap_s: float) -> str:
    script, now_s, held, said = Random(7), 0.0, set[str](), sha256()
    keys = KeyState(MAP, gap_s=gap_s)
    keys.arm("by the test")
    for _ in range(5000):
        chance, name = script.random(), COMMANDS[int(script.random() * len(COMMANDS))]
        now_s = round(now_s + (0.4 if chance > 0.95 else 0.03) * script.random(), 4)
        if chance < 0.4:
            held.add(name)
            keys.command(name, now_s)
        elif chance < 0.6:
            held.discard(name)
            keys.state(held, now_s)
        elif chance < 0.9:
            keys.still_held(now_s)
        elif chance > 0.99:
            keys.arm("again")
        keys.tick(now_s)
        due = None if keys.due_s is None else round(keys.due_s, 6)
        said.update(repr((keys.strokes, keys.notes, keys.down, keys.profile, due)).encode())
        keys.strokes.clear()
        keys.notes.clear()
    return said.hexdigest()[:16]


@pytest.mark.parametrize("gap_s", GOLDEN)
def test_every_stroke_is_the_same(gap_s: float) -> None:
    assert digest(gap_s) == GOLDEN[gap_s]
