"""Environment for reinforcement learning, with the API of Gymnasium (the extra `[gym]`).

    import gymnasium, tetris.bots.gym_env
    env = gymnasium.make("Tetris/Inputs-v0")       # or "Tetris/Placements-v0"

docs/tetris.md "environment" has the observations, actions and rewards.
"""

import tomllib
from importlib.resources import files
from typing import Any, Final, Literal, cast

import numpy as np
from numpy.typing import NDArray

try:
    import gymnasium
    from gymnasium import spaces
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        "tetris.bots.gym_env needs Gymnasium, which is not installed; pip install 'orbtouch[gym]'",
        name=error.name,
    ) from error

from tetris.bots.placements import find, paths
from tetris.engine.board import EMPTY, GARBAGE, row_shift
from tetris.engine.game import Action, Config, Game, Phase
from tetris.engine.moves import Spin, entered, spin
from tetris.engine.pieces import KINDS, LAST_KICK, SHAPES, STRIDE, Kind, Piece

Observation = dict[str, NDArray[np.uint8]]
Acts = Literal["inputs", "placements"]

INPUTS: Final[tuple[tuple[Action, ...], ...]] = (
    (),  # wait
    (Action.LEFT,),
    (Action.RIGHT,),
    (Action.DOWN,),
    (Action.HARD_DROP,),
    (Action.ROTATE_CW,),
    (Action.ROTATE_CCW,),
    (Action.HOLD,),
)
_ABOVE_ROWS: Final = 4  # rows above the visible ones that an observation shows
_NUMBERS: Final[dict[Kind | None, int]] = {None: 0} | {kind: n for n, kind in enumerate(KINDS, 1)}
_CELL: Final = 12  # pixels, the side of a block of a picture
_THEME: Final = tomllib.loads((files("assets") / "tetris" / "palettes.toml").read_text("utf-8"))[
    "dark"
]
_COLOURS: Final = dict(
    zip((*KINDS, GARBAGE, EMPTY), (*_THEME["pieces"], _THEME["well"]), strict=True)
)
_TURNS: Final = 4
_KICKS: Final = {Spin.FULL: LAST_KICK, Spin.MINI: 0, Spin.NONE: None}  # judged so; best first
_STANDARD: Final = Config()


class TetrisEnv(gymnasium.Env[Observation, np.int64]):
    """One game an episode; `game` is its engine, to look at."""

    metadata = {  # noqa: RUF012 (Gymnasium's own)
        "render_modes": ["ansi", "rgb_array"],
        "render_fps": 20,
    }

    def __init__(
        self,
        acts: Acts = "inputs",
        config: Config = _STANDARD,
        *,
        step_s: float = 0.05,
        render_mode: str | None = None,
    ) -> None:
        """Make an environment.

        Args:
            acts: "inputs": an action is one input, an index into `INPUTS`, and time passes.
                "placements": an action is where the piece locks, see `encode`, and no time
                passes.
            config: The rules.
            step_s: The time that an input takes.
            render_mode: "ansi", "rgb_array" or None.
        """
        self.acts = acts
        self.render_mode = render_mode
        self._config, self._step_s = config, step_s
        rows, columns, queue = config.rows + _ABOVE_ROWS, config.columns, config.previews
        picture = spaces.Box(0, 1, (rows, columns), np.uint8)
        pieces = spaces.MultiDiscrete([len(_NUMBERS), 2, *[len(_NUMBERS)] * queue], np.uint8)
        seen = spaces.Dict({"board": picture, "piece": picture, "pieces": pieces})
        self.observation_space = cast("spaces.Space[Observation]", seen)
        self._rows = rows
        self._places = _TURNS * columns * rows  # without and with a hold before
        count = len(INPUTS) if acts == "inputs" else 2 * self._places
        self.action_space = spaces.Discrete(count)
        self._block = (1 << rows * STRIDE) - 1
        self._bytes = (2 * rows * STRIDE + 7) // 8
        self.game = Game(0, config)
        self._time_s = 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a game; without a seed, the next one of the last seed's generator."""
        super().reset(seed=seed, options=options)
        self.game = Game(int(self.np_random.integers(2**32)), self._config)
        self._time_s = 0.0
        self.game.update(0.0)
        return self._observe(), self._info()

    def step(self, action: np.int64 | int) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Act; the reward is the points that it made, termination the game's end."""
        game = self.game
        before = game.score
        if self.acts == "inputs":
            self._time_s += self._step_s
            game.update(self._time_s, INPUTS[action])
            info: dict[str, Any] = {"lines": game.lines}
        else:
            reachable = self._place(int(action))
            info = self._info() | {"reachable": reachable}
        over = game.phase is Phase.OVER
        return self._observe(), float(game.score - before), over, False, info

    def render(self) -> str | NDArray[np.uint8] | None:
        """Return the visible rows and the four above them, by the mode of the environment.

        "ansi": text, the piece in small letters. "rgb_array": a picture, (12 rows, 12 columns, 3).
        """
        if self.render_mode not in self.metadata["render_modes"]:
            return None
        game = self.game
        rows = [list(row) for row in game.board.rows[: self._rows]]
        rows += [[EMPTY] * self._config.columns for _ in range(self._rows - len(rows))]
        for x, y in game.piece.cells if game.in_play else ():
            if y < self._rows:
                rows[y][x] = game.piece.kind.lower()
        if self.render_mode == "ansi":
            return "\n".join("".join(row) for row in reversed(rows))
        colours = [[_COLOURS[mark.upper()] for mark in row] for row in reversed(rows)]
        return np.array(colours, np.uint8).repeat(_CELL, axis=0).repeat(_CELL, axis=1)

    def action_masks(self) -> NDArray[np.bool_]:
        """Return the actions in reach, (actions,); of inputs, all are always allowed."""
        mask = np.zeros(int(self.action_space.n), np.bool_)  # type: ignore[attr-defined]
        if self.acts == "inputs":
            mask[:] = True
        elif self.game.in_play:
            for held, piece in enumerate(self._pieces()):
                if piece is not None:
                    places = find(self.game.board.bits, piece, self._config.kicks)
                    mask[[self.encode(place, hold=bool(held)) for place in places]] = True
        return mask

    def encode(self, piece: Piece, *, hold: bool = False) -> int:
        """Return the action that locks a piece there, after a hold if `hold` is set.

        It is `((hold * 4 + turn) * columns + leftmost column) * rows + lowest row`, where
        the four rows above the visible ones count.
        """
        column = piece.x + min(x for x, _ in SHAPES[piece.kind][piece.turn])
        columns, row = self._config.columns, piece.lowest_row
        return ((hold * _TURNS + piece.turn) * columns + column) * self._rows + row

    def _pieces(self) -> tuple[Piece, Piece | None]:
        """Return the piece in play, and the one that a hold would bring, where it enters."""
        game = self.game
        if not (game.can_hold and self._config.hold):
            return game.piece, None
        kind = game.hold or game.next[0]
        piece = Piece.entering(kind, self._config.columns, self._config.rows)
        return game.piece, entered(game.board.bits, piece)

    def _place(self, action: int) -> bool:
        """Lock the piece; where that is out of reach, drop it from where it is."""
        game = self.game
        hold, action = divmod(action, self._places)
        if hold:
            game.update(0.0, (Action.HOLD,))
        place = None
        if game.in_play and not (hold and game.can_hold):
            found = find(game.board.bits, game.piece, self._config.kicks)
            place = next((piece for piece in found if self.encode(piece) == action), None)
        if place:
            game.put(place, self._kick(place))
        game.update(0.0, (Action.HARD_DROP,))
        return place is not None

    def _kick(self, place: Piece) -> int | None:
        """Return the kick by which the best spin leads to a place, if one does."""
        bits = self.game.board.bits
        if spin(bits, place, 0) is Spin.NONE:
            return None
        ways = paths(bits, self.game.piece, self._config.kicks)
        spins = {its_spin for piece, its_spin, _ in ways if piece == place}
        return next(kick for its_spin, kick in _KICKS.items() if its_spin in spins)

    def _info(self) -> dict[str, Any]:
        info: dict[str, Any] = {"lines": self.game.lines}
        if self.acts == "placements":
            info["action_mask"] = self.action_masks()
        return info

    def _observe(self) -> Observation:
        game, rows = self.game, self._rows
        floor, size = row_shift(0), rows * STRIDE
        bits = game.board.bits >> floor & self._block
        if game.in_play:
            bits |= (game.piece.mask >> floor & self._block) << size
        raw = np.frombuffer(bits.to_bytes(self._bytes, "little"), np.uint8)
        cells = np.unpackbits(raw, count=2 * size, bitorder="little").reshape(2, rows, STRIDE)
        # Without walls, the top row first, and as other libraries take it without a copy.
        cells = np.ascontiguousarray(cells[:, ::-1, 1 : self._config.columns + 1])
        numbers = _NUMBERS
        pieces = bytearray((numbers[game.hold], game.can_hold))
        pieces += bytes([numbers[kind] for kind in game.next])
        return {
            "board": cells[0],
            "piece": cells[1],
            "pieces": np.frombuffer(pieces, np.uint8),
        }


for _name, _acts in (("Inputs", "inputs"), ("Placements", "placements")):
    gymnasium.register(
        f"Tetris/{_name}-v0",
        "tetris.bots.gym_env:TetrisEnv",
        kwargs={"acts": _acts},
        disable_env_checker=True,  # it looks at every observation, and takes longer than the game
    )
