"""`models train`: from folders of recordings to a proven bundle."""

import argparse
import shlex
from dataclasses import fields, replace
from pathlib import Path
from typing import Final

from controller.shared import errors
from controller.shared.arguments import whole
from models.cli import _options as options
from models.training.request import SIMULATED, Request

DESCRIPTION: Final = (
    "Read recordings of any grid, rate and labels, check them, hold some sessions out, train "
    "CNN-3D (gestures) and CNN-2D (where a press is), and write a bundle that proves itself, with "
    "its card and figures beside it. Interrupted, the same command goes on where it was."
)
SHARED: Final = ("labels", "all", "window", "seed")
FLAGS: Final = {"every": "all"}
SEEN: Final = 0.005  # share of gestures lost that recordings should be able to show
EXAMPLE: Final = (
    "Try it (three minutes): models simulate --out data --users 3 --sessions 2, then models train "
    "data --out my.orb --epochs 8"
)


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.set_defaults(resumes=True)
    add = parser.add_argument
    add("paths", type=Path, nargs="*", metavar="DIR", help="folders of recordings, or files")
    add("--out", type=Path, required=True, metavar="FILE", help="bundle to write: NAME.orb")
    options.take(parser, *SHARED)
    for field in fields(Request):
        if field.metadata:
            how = dict(field.metadata)
            flag, limits = how.pop("flag", field.name), how.pop("range", None)
            if limits:
                how["type"] = whole(*limits)
            add(f"--{flag}", dest=field.name, default=field.default, **how)


def run(arguments: argparse.Namespace) -> int:
    """Train, or choose thresholds, and print the figures."""
    given = options.chosen(arguments, Request)
    for name in ("paths", "auxiliary", "others"):
        given[name] = tuple(given[name])
    request = Request(**given)
    request.check()
    request = replace(request, command=_command(request))
    if request.epochs == 0:
        return _choose(request)
    options.require("training", "torch", "sklearn", "onnx", "tomli_w", "matplotlib")
    from models.reports import cards
    from models.results.training import Training
    from models.training.train import train

    result = train(request, errors.say)
    if isinstance(result, Training):
        print(cards.headline(result))
        verdict = result.gesture.verdict if result.gesture is not None else ()
        print("\n".join(f"- {line}" for line in (*verdict, *result.advice)))
        follow = (
            f"models train DIR --from {request.out} --epochs 0 --out {request.out}, "
            f"models evaluate {request.out} DIR"
        )
    elif isinstance(result, str):
        print(result)
        follow = f"models evaluate {request.out}, or controller install {request.out}"
    else:
        print(cards.users(result))
        follow = f"controller install {request.out}, or controller --bundle {request.out}"
    beside = "" if request.task in SIMULATED else ", and its card and figures beside it"
    errors.say(f"wrote {request.out}{beside}")
    errors.say(f"next: {follow}")
    return 0


def _choose(request: Request) -> int:
    """Choose when a gesture counts, and print how."""
    options.require("choosing thresholds", "tomli_w")
    from models.evaluation.tune import GOAL
    from models.reports import tables
    from models.training.train import choose_thresholds

    found = choose_thresholds(request, errors.say)
    print(tables.thresholds(found).markdown())
    print(f"{found.tried} points, {len(found.front)} of them on the front; {GOAL}")
    if (unseen := 3.0 / found.events) > SEEN:
        print(
            f"losses below {unseen:.1%} cannot be seen in {errors.count(found.events, 'event')}: "
            "record more before you make it faster"
        )
    errors.say(f"wrote {request.out}")
    errors.say("a choice flatters what it was made on: judge it on other recordings")
    return 0


def _command(request: Request) -> str:
    """Return the command line without defaults: the same for the same bundle."""
    words = ["models", "train", *map(str, request.paths)]
    for field in fields(Request):
        value, flag = getattr(request, field.name), FLAGS.get(field.name, field.name)
        if not (field.metadata or flag in SHARED) or value == field.default:
            continue
        words.append(f"--{field.metadata.get('flag', flag)}")
        if field.name == "gestures":
            words.append(",".join(value))
        elif isinstance(value, tuple):
            words += map(str, value)
        elif value is not True:
            words.append(str(value))
    return shlex.join([*words, "--out", request.out.name])
