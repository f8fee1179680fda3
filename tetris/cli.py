"""Command line of Tetris: a window, and bots and replays with or without one."""

import argparse
import errno
import json
import os
import secrets
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import Any, Final, NoReturn

from tetris.bots import BOTS, STRONGEST
from tetris.engine.game import Game, Phase
from tetris.engine.modes import MODES
from tetris.engine.rules import LAST_GRAVITY_LEVEL
from tetris.history.replay import Player, Recorder, play_bot
from tetris.history.replay_file import ReplayError, load, save

_MOST_PIECES: Final = 1_000_000
_LAST_SEED: Final = 2**32 - 1
_BOT_RATE_HZ: Final = 12  # where the clock counts: a quick hand


def run(argv: list[str] | None = None) -> int:
    """Play, and return the exit status: 0 success, 1 trouble, 2 wrong usage."""
    for stream in (sys.stdout, sys.stderr):
        if (change := getattr(stream, "reconfigure", None)) is not None:
            change(errors="backslashreplace")  # characters that the terminal does not know
    try:
        return _play(_options(argv))
    except ReplayError as error:
        return complain(error, 2)


def _options(argv: list[str] | None) -> argparse.Namespace:
    parser = _parser()
    options = parser.parse_args(argv)
    levels = options.level and options.mode and not MODES[options.mode].levels
    refusals = {
        "--headless plays without a keyboard; add --bot or --replay FILE": options.headless
        and not (options.bot or options.replay),
        "--replay plays what was played; leave --bot and --mode out": options.replay
        and (options.bot or options.mode),
        "--replay plays what was played; leave --seed and --level out": options.replay
        and (options.seed is not None or options.level),
        f"--mode {options.mode} has no levels; leave --level out, or play "
        + ", ".join(mode.name for mode in MODES.values() if mode.levels): levels,
        "--record is for --headless; the window keeps its games by itself": options.record
        and not options.headless,
    }
    for sentence, refused in refusals.items():
        if refused:
            parser.error(sentence)
    return options


def _play(options: argparse.Namespace) -> int:
    if options.version:
        return say(f"tetris {_version()}")
    if options.headless:
        return _check(options) if options.replay else _play_unseen(options)
    app = _window()
    from tetris.kit.display import DisplayError

    if options.replay:
        load(options.replay)  # refused here, in a sentence, rather than in a window
    try:
        game = app.play(
            app.Start(options.mode, options.seed, options.level, options.bot, options.replay)
        )
    except DisplayError as error:
        return complain(f"{error}; without one, play with --headless --bot", 1)
    return 0 if game is None else _report(game, options.json)


def _window() -> ModuleType:
    """Import and return tetris.window.app: a headless game needs neither pygame nor the time.

    Ctrl+C exits at once meanwhile, as pygame makes another error of a KeyboardInterrupt.
    """
    ours = signal.getsignal(signal.SIGINT) is signal.default_int_handler  # not so under nohup
    if ours:
        signal.signal(signal.SIGINT, lambda *_: os._exit(130))
    from tetris.window import app

    if ours:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return app


def _play_unseen(options: argparse.Namespace) -> int:
    seed = secrets.randbits(32) if options.seed is None else options.seed
    mode = MODES[options.mode or "endless"]
    config = mode.config(options.level or 1, seed)
    recorder = Recorder(seed, config, mode.name)
    action_s = 1 / _BOT_RATE_HZ if config.time_limit_s else 0.0
    play_bot(recorder, BOTS[options.bot], pieces=options.pieces, action_s=action_s)
    if options.record:
        try:
            save(options.record, recorder.replay())
        except (OSError, ReplayError) as error:
            reason = getattr(error, "strerror", None) or error
            return complain(f"cannot write {options.record}: {reason}", 1)
    return _report(recorder.game, options.json)


def _check(options: argparse.Namespace) -> int:
    """Play a replay to its end without a window, and compare its end with the recorded outcome."""
    player = Player(load(options.replay))
    player.advance(player.end_s)
    if player.differs:
        return complain(
            f"{options.replay}: the replay ends otherwise than it was recorded; "
            "it was made by another program, or altered",
            1,
        )
    return _report(player.game, options.json)


def say(line: str) -> int:
    """Print a result; return the exit status: 0, or 1 if it cannot be printed."""
    try:
        if sys.stdout is None:  # the program was started without one
            raise OSError(errno.EBADF, "standard output is closed")
        print(line, flush=True)
    except OSError as error:  # a full disk, or the reader of the pipe has ended
        with suppress(OSError, ValueError, AttributeError):
            # Python flushes the stream once more at exit: point it at nothing.
            nothing = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nothing, sys.stdout.fileno())
            os.close(nothing)
        return complain(f"cannot print the result: {error.strerror}", 1)
    return 0


def complain(problem: Exception | str, status: int) -> int:
    """Print an error message on standard error; return the exit status."""
    with suppress(OSError, ValueError):  # standard error may be closed; the status remains
        print(f"tetris: {printable(str(problem))}", file=sys.stderr)
    return status


def printable(text: str) -> str:
    """Return a text with escapes in place of characters that would control a terminal."""
    return "".join(sign if sign.isprintable() else repr(sign)[1:-1] for sign in text)


def _version() -> str:
    try:
        return metadata.version("orbtouch")
    except metadata.PackageNotFoundError:  # unpacked, not installed
        return "of no known version"


def _report(game: Game, as_json: bool) -> int:
    result = {
        "seed": game.seed,
        "score": game.score,
        "level": game.level,
        "lines": game.lines,
        "pieces": game.pieces_placed,
        "time_s": round(game.time_s, 3),
        "over": game.phase is Phase.OVER,
        "result": game.result.value if game.result else None,
    }
    if as_json:
        return say(json.dumps(result))
    return say(
        f"{_count(game.score, 'point')}, {_count(game.lines, 'line')}, level {game.level}, "
        f"{_count(game.pieces_placed, 'piece')} (seed {game.seed})",
    )


def _count(number: int, noun: str) -> str:
    return f"{number:,} {noun}" + "s" * (number != 1)


class _Parser(argparse.ArgumentParser):
    """A parser that answers wrong usage in one printable sentence, whatever was typed."""

    def print_help(self, file: object = None) -> NoReturn:
        sys.exit(say(self.format_help().rstrip()))

    def error(self, message: str) -> NoReturn:
        from difflib import get_close_matches  # in here: it compiles regular expressions

        odd = message.partition("unrecognized arguments: ")[2].split(" ")[0].partition("=")[0]
        if odd and (near := get_close_matches(odd, self._option_string_actions, n=1)):
            message += f"; did you mean {near[0]}?"
        sys.exit(complain(message, 2))


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="tetris",
        description="Play Tetris. Arrows shift, turn and lower a piece, Z turns it the other way, "
        "space drops it, C holds it, P pauses, R restarts.",
        epilog="Try it: tetris --bot",
    )

    def add(option: str, text: str, **how: Any) -> None:
        name, _, metavar = option.partition(" ")
        how |= {"metavar": metavar} if metavar else {"action": "store_true"}
        parser.add_argument(name, help=text, **how)

    seed = _whole(_LAST_SEED, least=0)
    add("--mode NAME", f"begin at once with {', '.join(MODES)} (default: the menu)", choices=MODES)
    add("--seed N", "which game; the same again (default: a new one)", type=seed)
    level = f"level to start with, 1 to {LAST_GRAVITY_LEVEL}, where the mode has levels"
    add("--level N", level, type=_whole(LAST_GRAVITY_LEVEL))
    bot = f"watch a bot play: {', '.join(BOTS)} (default: {STRONGEST})"
    add("--bot NAME", bot, nargs="?", choices=BOTS, const=STRONGEST)
    add("--replay FILE", "watch a recorded game; headless: check it", type=Path)
    add("--headless", "no window, as fast as it can; with --bot, --replay")
    pieces = "pieces of a bot's headless game (default: %(default)s)"
    add("--pieces N", pieces, type=_whole(_MOST_PIECES), default=1000)
    add("--record FILE", "keep a headless game", type=Path)
    add("--json", "print the result as JSON")
    add("--version", "print the version")
    return parser


def _whole(most: int, *, least: int = 1) -> Callable[[str], int]:
    """Return a reader of whole numbers from `least` to `most`."""

    def read(words: str) -> int:
        short = len(words) <= len(str(most)) and words.isascii() and words.isdecimal()
        if not (short and least <= int(words) <= most):
            wanted = f"a whole number from {least} to {most}"
            raise argparse.ArgumentTypeError(f"{words[:40]} must be {wanted}")
        return int(words)

    return read
