"""Replay files: short lines of text, and a checksum. docs/tetris-replays.md has the form.

Everything in a file is bounded and checked before a game is made of it; a file that cannot be
read is refused with one sentence.
"""

import hashlib
import math
import re
import textwrap
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tetris.engine import rules
from tetris.engine.events import Action, Gravity
from tetris.engine.rules import Config
from tetris.files import read_bytes, write_beside
from tetris.history.replay import Moment, Outcome, Replay, check_game

SUFFIX: Final = ".tetris"
FORM: Final = 1  # of the file, not of the rules
_TITLE: Final = "tetris-replay"
_MOST_BYTES: Final = 8_000_000  # a day of play at ten inputs a second
_MOST_NUMBER: Final = 2**64 - 1
_MOST_INPUTS: Final = 1_000_000  # and as many moments
_MOST_GAMES: Final = 1_000  # restarts within one replay, and the first game: each is work to play
_MOST_US: Final = 400 * 3_600_000_000  # of the clock
_LINE: Final = 96

_CODES: Final = {
    Action.LEFT: "l",
    Action.RIGHT: "r",
    Action.DOWN: "d",
    Action.HARD_DROP: "D",
    Action.ROTATE_CW: "c",
    Action.ROTATE_CCW: "w",
    Action.HOLD: "h",
    Action.PAUSE: "p",
    Action.RESTART: "n",
    Action.UNDO: "u",
}
_ACTIONS: Final = {code: action for action, code in _CODES.items()}
# Microseconds since the moment before; inputs; soft drop held or not; what is held at an entrance.
_MOMENT: Final = re.compile(
    r"(0|[1-9]\d{0,14})((?:[lrdDcwhpnu]|f[1-9]\d{0,6})*)([Ss]?)(\[c?w?h?\])?",
    re.ASCII,
)
_INPUT: Final = re.compile(r"f\d+|.", re.ASCII)
_WHOLE: Final = re.compile(r"0|[1-9]\d{0,19}", re.ASCII)
_NUMBER: Final = re.compile(r"\d{1,17}(\.\d{1,25})?(e[+-]?\d{1,3})?", re.ASCII)
_KINDS: Final = {  # types or words that `Config` declares for its fields, in the order of the file
    name: typing.get_args(declared) or (declared,)
    for name, declared in typing.get_type_hints(Config).items()
}
_WITHOUT_DIGITS: Final = str.maketrans("", "", "0123456789")
_WRAPPER: Final = textwrap.TextWrapper(_LINE, break_long_words=False, break_on_hyphens=False)


class ReplayError(ValueError):
    """A file is no replay that can be played here, or a replay cannot become one."""


def save(path: Path, replay: Replay) -> None:
    """Write a replay; a crash leaves the whole file or none.

    Raises:
        OSError: It cannot be written.
        ReplayError: `load` would refuse the file.
    """
    write_beside(path, encode(replay))


def load(path: Path) -> Replay:
    """Read a replay; raise ReplayError for a file that cannot be read, or is no replay of here."""
    try:
        return decode(read_bytes(path, _MOST_BYTES))
    except OSError as error:
        raise ReplayError(f"cannot read {path}: {error.strerror or error}") from error
    except ReplayError as error:
        raise ReplayError(f"{path}: {error}") from error


def encode(replay: Replay) -> bytes:
    """Return the bytes of a file; raise ReplayError for what `decode` would refuse."""
    outcome = replay.outcome
    head = [
        f"{_TITLE} {FORM}",
        f"rules {rules.VERSION}",
        f"seed {replay.seed}",
        f"mode {replay.mode}",
        *(f"{name} {_written(name, getattr(replay.config, name))}" for name in _KINDS),
        f"outcome {outcome.score} {outcome.lines} {outcome.pieces} {outcome.over:d}",
        f"end {replay.end_us}",
        f"moments {len(replay.moments)}",
    ]
    before = (Moment(0), *replay.moments)
    words = " ".join(map(_moment_word, replay.moments, before))
    body = "\n".join([*head, *_WRAPPER.wrap(words)]) + "\n"
    content = f"{body}sha256 {_digest(body)}\n".encode("ascii", "replace")
    if decode(content) != replay:
        raise ReplayError("the replay cannot be kept: the file would hold another one")
    return content


def decode(content: bytes) -> Replay:
    """Read the bytes of a file; raise ReplayError for foreign, damaged and older ones."""
    if not content.startswith(f"{_TITLE} ".encode("ascii")):
        raise ReplayError("this is no replay of this game")
    if len(content) > _MOST_BYTES:
        raise ReplayError(f"a replay has {_MOST_BYTES // 1_000_000} MB at most")
    try:
        text = content.decode("ascii")
    except UnicodeDecodeError as error:
        raise ReplayError("the replay is damaged: there is other than text in it") from error
    body, mark, last = text.rpartition("\nsha256 ")
    lines = iter((body or text).split("\n"))
    form, made_by = _number(lines, _TITLE), _number(lines, "rules")
    if form != FORM:
        raise ReplayError(f"the replay has form {form}, and this program reads form {FORM}")
    if made_by != rules.VERSION:
        raise ReplayError(
            f"the replay is of rules {made_by}, and this program plays rules {rules.VERSION}; "
            "play it with the version that made it"
        )
    if not mark or last != f"{_digest(body + chr(10))}\n":
        raise ReplayError("the replay is damaged: its checksum does not fit")
    return _replay(lines)


def _value(lines: Iterator[str], name: str) -> str:
    """Return the value of the next line, which must have this name."""
    line = next(lines, "")
    found, space, value = line.partition(" ")
    if found != name or not space:
        raise ReplayError(f"the replay is damaged: {line[:40]!r} stands where {name} should")
    return value


def _number(lines: Iterator[str], name: str, most: int = _MOST_NUMBER) -> int:
    return _whole(name, _value(lines, name), most)


def _replay(lines: Iterator[str]) -> Replay:
    seed, mode = _number(lines, "seed"), _value(lines, "mode")
    rules_of = {name: _read(name, _value(lines, name)) for name in _KINDS}
    try:
        check_game(seed, mode)
        config = Config(**rules_of)
    except ValueError as error:
        raise ReplayError(f"the replay's game cannot be played: {error}") from error
    outcome = _outcome(_value(lines, "outcome"))
    end_us, count = _number(lines, "end", _MOST_US), _number(lines, "moments", _MOST_INPUTS)
    moments = _moments("\n".join(lines).split(maxsplit=count))
    if len(moments) != count or not moments or moments[-1].time_us > end_us:
        raise ReplayError("the replay is damaged: its moments do not fit its head")
    return Replay(seed, config, mode, moments, end_us, outcome)


def _outcome(value: str) -> Outcome:
    words = value.split(" ")
    if len(words) != 4 or words[3] not in ("0", "1"):
        raise ReplayError("the replay is damaged: its outcome is not four numbers")
    score, cleared, pieces = (_whole("outcome", word, _MOST_NUMBER) for word in words[:3])
    return Outcome(score, cleared, pieces, words[3] == "1")


# -- the rules ---------------------------------------------------------------------------------


def _written(name: str, value: typing.Any) -> str:
    """Return a value of the rules as one word, by the type that `Config` declares."""
    kinds = _KINDS[name]
    if value is None:
        return "none"
    if bool in kinds:
        return "yes" if value else "no"
    if int in kinds:
        return str(int(value))
    if float in kinds:
        return repr(float(value) + 0.0)  # without the sign of a zero
    return "/".join(value.split()) or "-"


def _read(name: str, word: str) -> typing.Any:
    """Read one value of the rules by the type that `Config` declares."""
    kinds = _KINDS[name]
    if word == "none" and types.NoneType in kinds:
        return None
    if bool in kinds and word in ("yes", "no"):
        return word == "yes"
    if int in kinds:
        return _whole(name, word, _MOST_NUMBER)
    if float in kinds and _NUMBER.fullmatch(word):
        number = float(word)
        if math.isfinite(number) and number <= _MOST_US / 1e6:
            return number
    if str in kinds or any(isinstance(kind, str) for kind in kinds):
        return "" if word == "-" else word.replace("/", "\n")
    raise ReplayError(f"the replay is damaged: {name} cannot be {word[:40]!r}")


def _whole(name: str, word: str, most: int) -> int:
    if not _WHOLE.fullmatch(word) or int(word) > most:
        raise ReplayError(f"the replay is damaged: {name} cannot be {word[:40]!r}")
    return int(word)


# -- the moments -------------------------------------------------------------------------------


def _moment_word(moment: Moment, before: Moment) -> str:
    word = str(moment.time_us - before.time_us)
    for given in moment.inputs:
        word += _CODES[given] if isinstance(given, Action) else f"f{given.row_us}"
    if moment.soft_drop != before.soft_drop:
        word += "S" if moment.soft_drop else "s"
    if moment.initial != before.initial:
        word += f"[{''.join(_CODES[action] for action in moment.initial)}]"
    return word


def _moments(words: list[str]) -> tuple[Moment, ...]:
    moments: list[Moment] = []
    before, games, inputs = Moment(0), 1, 0
    for word in words:
        found = _MOMENT.fullmatch(word)
        if not found:
            raise ReplayError(f"the replay is damaged: {word[:40]!r} is no moment")
        wait, codes, soft, held = found.groups()
        games += codes.count("n")
        inputs += len(codes.translate(_WITHOUT_DIGITS))
        if inputs > _MOST_INPUTS:
            raise ReplayError(f"a replay has {_MOST_INPUTS:,} inputs at most; this one has more")
        before = Moment(
            before.time_us + int(wait),
            tuple(_ACTIONS.get(code) or Gravity(int(code[1:])) for code in _INPUT.findall(codes)),
            soft == "S" if soft else before.soft_drop,
            before.initial if held is None else tuple(_ACTIONS[code] for code in held[1:-1]),
        )
        moments.append(before)
    if games > _MOST_GAMES:
        raise ReplayError(f"a replay has {_MOST_GAMES} games at most; this one has {games}")
    return tuple(moments)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode("ascii")).hexdigest()
