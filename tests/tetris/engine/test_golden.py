"""Whole games against earlier ones: no rule of any mode changes unnoticed.

Each mode is played with a script drawn from its name; the digest is that of all events and the
last snapshot. When a change is meant to change games, take the new digests from the failures.
"""

from hashlib import sha256
from random import Random

import pytest

from tetris.engine.events import Action, Input
from tetris.engine.game import Config, Game
from tetris.engine.modes import MODES
from tetris.engine.rules import VERSION, Phase

LIKELY = (Action.LEFT, Action.RIGHT, Action.ROTATE_CW, Action.ROTATE_CCW)
GIVEN: list[Input] = [*LIKELY, *LIKELY, *(a for a in Action if a is not Action.RESTART)]
GOLDEN = {
    "marathon": "97f7a54cdb5e367c",
    "endless": "ab5f61cb04613979",
    "sprint": "385cee80c4960b61",
    "ultra_2": "b83e39ffe879a26f",
    "ultra_3": "93b65ba9d5b7b68a",
    "zen": "970aadfddb6d7969",
    "dig": "fdd3dde471f45dc9",
    "orb_marathon": "dfaddca18029d212",
    "orb_sprint": "1efa85aaab5f79f5",
    "orb_ultra": "ea65ba917544194c",
    "narrow": "75f537a6b4f70475",
    "fast": "b17524a1eb0deb5f",
    "slow": "6fe0eb8422866952",
}


def configs() -> dict[str, Config]:
    """The rules of each mode, and those that no mode has."""
    return {
        **{name: mode.config(7, 4) for name, mode in MODES.items()},
        "narrow": Config(columns=4, rows=12, generation_delay_s=0.1, partial_lock_out=True),
        "fast": Config(
            columns=5, kicks="srs+", randomiser="uniform", start_level=15, lock_resets=0
        ),
        "slow": Config(columns=4, lock_resets=None, guard_s=0.3, gravity_cap=3, start_level=9),
    }


def digest(name: str, config: Config) -> str:
    script, game, now_s = Random(name), Game(7, config), 0.0
    said = sha256()
    for _ in range(5000):
        now_s = round(now_s + (0.9 if script.random() < 0.2 else 0.1) * script.random(), 4)
        inputs = [GIVEN[int(script.random() * len(GIVEN))]]
        soft = script.random() < 0.2
        held = [Action.ROTATE_CW] if script.random() < 0.3 else []
        said.update(repr(game.update(now_s, inputs, soft_drop=soft, initial=held)).encode())
        if game.phase is Phase.OVER:
            game.update(now_s, [Action.RESTART])
    said.update(repr(game.snapshot()).encode())
    return said.hexdigest()[:16]


@pytest.mark.parametrize("name", configs())
def test_a_game_goes_as_it_went(name: str) -> None:
    assert VERSION == 1  # raise it with new digests: replays of the old rules are refused then
    assert digest(name, configs()[name]) == GOLDEN[name]
