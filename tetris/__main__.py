"""The command line: Tetris by keyboard, or the bot, in a window or without one."""

import argparse
import json
import secrets
import sys
from collections.abc import Callable
from typing import Final

from tetris import bot
from tetris.console import say
from tetris.engine import Config, Game, Phase

_LAST_LEVEL: Final = 20
_MOST_PIECES: Final = 1_000_000
_LAST_SEED: Final = 2**32 - 1
_BOT_ACTION_S: Final = 0.08  # quick, and still to be followed by eye
_INTERRUPTED: Final = 130  # what shells expect after Ctrl+C


def main(argv: list[str] | None = None) -> int:
    """Play, and return the exit status: 0 success, 1 trouble, 2 wrong usage, 130 Ctrl+C."""
    parser = _parser()
    options = parser.parse_args(argv)
    if options.headless and not options.bot:
        parser.error("--headless leaves nobody to press keys; add --bot")
    try:
        return _play(options)
    except KeyboardInterrupt:
        return _INTERRUPTED


def _play(options: argparse.Namespace) -> int:
    seed = secrets.randbits(32) if options.seed is None else options.seed
    config = Config(start_level=options.level)
    if options.headless:
        return _report(_play_unseen(seed, config, options.pieces), seed, options.json)
    # Imported here, because a headless game needs neither pygame nor the time it takes.
    from tetris.window.app import play
    from tetris.window.display import DisplayError

    try:
        game = play(seed, config, bot_action_s=_BOT_ACTION_S if options.bot else None)
    except DisplayError as error:
        print(f"tetris: {error}; without one, play with --headless --bot", file=sys.stderr)
        return 2
    return _report(game, seed, options.json)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="tetris",
        description="Play Tetris. Arrows shift, turn and lower a piece, Z turns it the other way, "
        "space drops it, C holds it, P pauses, R begins anew.",
        epilog="Try it: tetris --bot",
    )
    parser.add_argument(
        "--seed",
        type=_whole(_LAST_SEED, least=0),
        metavar="N",
        help="which game; the same again (default: a new one)",
    )
    parser.add_argument(
        "--level",
        type=_whole(_LAST_LEVEL),
        default=1,
        metavar="N",
        help=f"level to start with, 1 to {_LAST_LEVEL} (default: %(default)s)",
    )
    parser.add_argument("--bot", action="store_true", help="watch the bot play")
    parser.add_argument(
        "--headless", action="store_true", help="no window, as fast as it can; needs --bot"
    )
    parser.add_argument(
        "--pieces",
        type=_whole(_MOST_PIECES),
        default=1000,
        metavar="N",
        help="pieces of a headless game (default: %(default)s)",
    )
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    return parser


def _whole(most: int, *, least: int = 1) -> Callable[[str], int]:
    """Return a reader of whole numbers from `least` to `most`."""

    def read(words: str) -> int:
        if not (words.isascii() and words.isdecimal() and least <= int(words) <= most):
            wanted = f"a whole number from {least} to {most}"
            raise argparse.ArgumentTypeError(f"{words} must be {wanted}")
        return int(words)

    return read


def _play_unseen(seed: int, config: Config, pieces: int) -> Game:
    game = Game(seed, config)
    while game.phase is Phase.RUNNING and game.pieces_placed < pieces:
        game.update(0.0, bot.plan(game).actions)
    return game


def _report(game: Game, seed: int, as_json: bool) -> int:
    result = {
        "seed": seed,
        "score": game.score,
        "level": game.level,
        "lines": game.lines,
        "pieces": game.pieces_placed,
        "over": game.phase is Phase.OVER,
    }
    if as_json:
        return say("tetris", json.dumps(result))
    return say(
        "tetris",
        f"{game.score:,} points, {game.lines:,} lines, level {game.level}, "
        f"{game.pieces_placed:,} pieces (seed {seed})",
    )


if __name__ == "__main__":
    sys.exit(main())
