"""`models train`: from folders of recordings to a proven bundle."""

import argparse
import os
import shlex
from pathlib import Path
from typing import Final

from models.cli import _options as options

SUMMARY: Final = "make a bundle from recordings"
DESCRIPTION: Final = (
    "Read recordings of any grid, rate and labels, check them, hold some sessions out, train "
    "CNN-3D (gestures) and CNN-2D (where a press is), and write a bundle that proves itself, with "
    "its card and figures beside it. Interrupted, the same command goes on where it was."
)
EXAMPLE: Final = (
    "Try it (three minutes): models simulate --out data --users 3 --sessions 2, then models train "
    "data --out my.orb --epochs 8"
)


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add("data", type=Path, nargs="+", metavar="DIR", help="folders of recordings, or files")
    add("--out", type=Path, required=True, metavar="FILE", help="bundle to write: NAME.orb")
    add(
        "--task",
        choices=("gesture", "location", "both", "user"),
        default="",
        help="what to train (default: gestures, and places where the recordings know them); user: "
        "who touches, from recordings of several people on several days (docs/users.md)",
    )
    add(
        "--recipe",
        choices=("default", "paper"),
        default="default",
        help="the best we know, or the paper's section 4.2 to the letter (default: default)",
    )
    add(
        "--labels",
        choices=("auto", "true", "button", "key", "cue"),
        default="auto",
        help="whose labels to learn from (default: auto: the first of these that names a gesture)",
    )
    options.take_all(parser)
    add(
        "--split",
        default="",
        metavar="BY",
        help="hold out sessions, users, the ends of sessions, or places (all touches nearest to "
        "some taxels): session, user, time, site (default: session, or time where there are fewer "
        "than four)",
    )
    add(
        "--with",
        dest="base",
        type=Path,
        metavar="BUNDLE",
        help="takes the network that is not trained from here (default: the one that ships)",
    )
    add(
        "--auxiliary",
        type=Path,
        nargs="+",
        default=[],
        metavar="DIR",
        help="with --task gesture: recordings with more gestures, which are learned beside the "
        "others and are no answers in the end, so that a new gesture is taught from fewer examples",
    )
    add(
        "--others",
        type=Path,
        nargs="+",
        default=[],
        metavar="DIR",
        help="with --task user: recordings of people who shall be taken for nobody",
    )
    add(
        "--gestures",
        default="",
        metavar="LABELS",
        help="with --task user: which gestures tell, such as twist_cw,twist_ccw (default: all)",
    )
    add(
        "--mapping",
        type=Path,
        metavar="FILE",
        help="with --task user: what gestures mean for single people, its tables [users.NAME] "
        "(docs/users.md); the bundle keeps them",
    )
    add("--seed", type=options.seed, default=0, help="of everything random (default: 0)")
    add(
        "--epochs",
        type=options.count,
        default=0,
        metavar="N",
        help="passes of CNN-3D over the examples, of CNN-2D four times as many (default: the "
        "recipe's)",
    )
    add(
        "--window",
        type=options.whole(2, 250),
        default=0,
        metavar="N",
        help="images in a window (default: those of one second)",
    )
    add(
        "--bare",
        action="store_true",
        help="leave out of the bundle what comparing speeds does not need: places, and weights "
        "beside those in the ONNX file",
    )
    add(
        "--no-advice",
        dest="advised",
        action="store_false",
        help="do not measure how much more examples would help",
    )


def run(arguments: argparse.Namespace) -> int:
    """Train, and print the figures."""
    from models.cli import _extras as extras

    extras.require("training", "torch", "onnx", "tomli_w", "jinja2", "matplotlib")
    # Before PyTorch wakes up: one thread, and a GPU that adds in one order.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")
    if arguments.task == "user":
        return _people(arguments)
    if arguments.others or arguments.gestures or arguments.mapping:
        raise ValueError("--others, --gestures and --mapping are for people; add --task user")
    from models.reports import cards
    from models.training.train import Request, train

    request = Request(
        paths=tuple(arguments.data),
        out=arguments.out,
        task=arguments.task,
        recipe=arguments.recipe,
        labels=arguments.labels,
        every=arguments.all,
        base=arguments.base,
        split=arguments.split,
        seed=arguments.seed,
        epochs=arguments.epochs,
        window=arguments.window,
        advised=arguments.advised,
        bare=arguments.bare,
        auxiliary=tuple(arguments.auxiliary),
        command=_command(arguments),
    )
    result = train(request, options.say)
    print(cards.headline(result))
    for line in result.advice:
        print(f"- {line}")
    options.say(f"wrote {request.out}, and its card and figures beside it")
    options.say(f"next: models tune {request.out} DIR, models evaluate {request.out} DIR")
    return 0


def _people(arguments: argparse.Namespace) -> int:
    """Train a network that tells people apart, and print what it is worth."""
    from models.reports import cards
    from models.training.train_users import Request, train

    for name in ("bare", "window", "auxiliary"):
        if getattr(arguments, name):
            raise ValueError(f"--{name} is not for people; leave it out")
    if arguments.recipe != "default":
        raise ValueError("there is one recipe for people; leave --recipe out")
    request = Request(
        paths=tuple(arguments.data),
        out=arguments.out,
        others=tuple(arguments.others),
        base=arguments.base,
        gestures=tuple(word for word in arguments.gestures.split(",") if word),
        labels=arguments.labels,
        every=arguments.all,
        split=arguments.split,
        seed=arguments.seed,
        epochs=arguments.epochs,
        command=_command(arguments),
        mapping=arguments.mapping,
    )
    found = train(request, options.say)
    print(cards.users(found))
    options.say(f"wrote {request.out}, and its card and figures beside it")
    options.say(f"next: controller install {request.out}, or controller --bundle {request.out}")
    return 0


def _command(arguments: argparse.Namespace) -> str:
    """Return what was typed, with what matters and no more: the same for the same bundle."""
    words = ["models", "train", *(str(path) for path in arguments.data)]
    for name in ("task", "recipe", "labels", "split", "base", "seed", "epochs", "window"):
        value = getattr(arguments, name)
        if value not in ("", 0, None, "default", "auto"):
            words += [f"--{'with' if name == 'base' else name}", str(value)]
    words += ["--all"] if arguments.all else []
    words += ["--bare"] if arguments.bare else []
    words += ["--gestures", arguments.gestures] if arguments.gestures else []
    words += ["--auxiliary", *map(str, arguments.auxiliary)] if arguments.auxiliary else []
    words += ["--mapping", str(arguments.mapping)] if arguments.mapping else []
    words += ["--others", *map(str, arguments.others)] if arguments.others else []
    return shlex.join([*words, "--out", arguments.out.name])


def resumes(arguments: argparse.Namespace) -> bool:
    """Whether the same command goes on where Ctrl-C ended it."""
    return bool(arguments.task != "user")
