"""Train the networks and judge them: the command line of the training machine."""

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

DESCRIPTION = "Simulate sessions, train the orb's networks on them, and judge bundles."
EXAMPLE = "Try it (ten seconds): models evaluate --sessions 2 --minutes 2"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one of the commands; return the exit status."""
    arguments = _parser().parse_args(argv)
    try:
        return int(arguments.run(arguments))
    except KeyboardInterrupt:
        print("models: interrupted; nothing was written", file=sys.stderr)
        return 1
    except (ValueError, OSError) as error:
        print(f"models: {error}", file=sys.stderr)
        return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="models", description=DESCRIPTION, epilog=EXAMPLE)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    train = commands.add_parser(
        "train",
        help="make a bundle from simulated sessions",
        description="Simulate sessions, train CNN-3D and CNN-2D, tune the debouncer, write a "
        "bundle. About a quarter of an hour on one core with the defaults.",
        epilog="Try it (one minute): models train --sessions 6 --minutes 3 --epochs 4 --out my.orb",
    )
    train.add_argument("--out", type=Path, required=True, metavar="FILE", help="bundle to write")
    train.add_argument("--sessions", type=_count, default=160, help="to train on (default: 160)")
    train.add_argument("--minutes", type=_length, default=6.0, help="of each (default: 6)")
    train.add_argument("--epochs", type=_count, default=16, help="of CNN-3D (default: 16)")
    train.add_argument("--seed", type=int, default=0, help="of everything random (default: 0)")
    train.set_defaults(run=_train)
    _add_simulate(commands)
    evaluate = commands.add_parser(
        "evaluate",
        help="judge a bundle on unseen sessions",
        description="Play simulated sessions whose seeds training never saw through a bundle.",
        epilog=EXAMPLE,
    )
    evaluate.add_argument("bundle", type=Path, nargs="?", help="default: the one that ships")
    evaluate.add_argument(
        "--sessions", type=_count, default=20, help="of each preset (default: 20)"
    )
    evaluate.add_argument("--minutes", type=_length, default=6.0, help="of each (default: 6)")
    evaluate.add_argument("--card", type=Path, metavar="FILE", help="write the figures as a card")
    evaluate.set_defaults(run=_evaluate)
    return parser


def _add_simulate(commands: Any) -> None:
    simulate = commands.add_parser(
        "simulate",
        help="write a data set of simulated sessions",
        description="Simulate users at play, with the truth beside every frame: a recording per "
        "user and session (docs/data.md). Interrupted, it goes on where it was.",
        epilog="Try it (ten seconds): models simulate --out data --users 2 --sessions 2 "
        "--minutes 2",
    )
    add = simulate.add_argument
    add("--out", type=Path, required=True, metavar="DIR", help="folder to write into")
    add("--users", type=_count, default=10, metavar="N", help="how many play (default: 10)")
    add("--sessions", type=_count, default=3, metavar="N", help="of each user (default: 3)")
    add(
        "--minutes",
        type=_length,
        metavar="M",
        help="of each session (default: 6 in free play, 29 in blocks, as in the paper)",
    )
    add(
        "--protocol",
        choices=("free", "blocks"),
        default="free",
        help="gestures in any order, or class by class as in the paper (default: free)",
    )
    add(
        "--preset",
        default="nominal",
        metavar="NAME",
        help="quality of the orbs: nominal, paper-snr (default: nominal)",
    )
    add(
        "--gestures",
        metavar="LIST",
        default="press,pinch,twist_cw,twist_ccw",
        help="labels to play and files of your own (docs/gestures.md), separated by commas: "
        "press,swipe,wave.toml (default: press,pinch,twist_cw,twist_ccw)",
    )
    add(
        "--seed",
        type=_seed,
        default=0,
        metavar="S",
        help="of everything random; 900000 to 999999 are for tests, which no training accepts "
        "(default: 0)",
    )
    add(
        "--workers",
        type=_count,
        default=os.cpu_count() or 1,
        metavar="W",
        help="processes (default: one per core)",
    )
    add(
        "--rate",
        type=_number(1.0, 200.0),
        default=10.0,
        metavar="HZ",
        help="frames per second, 1 to 200 (default: 10)",
    )
    add("--rows", type=_taxels, default=5, metavar="R", help="taxel rows, 2 to 32 (default: 5)")
    add("--columns", type=_taxels, default=5, metavar="C", help="taxel columns (default: 5)")
    add(
        "--pitch",
        type=_number(0.5, 34.0),
        metavar="MM",
        help="distance of two taxels (default: the grid is 40 mm long)",
    )
    simulate.set_defaults(run=_simulate)


def _simulate(arguments: argparse.Namespace) -> int:
    from controller.simulator.repertoire import label_in
    from models.simulate import DataSet, generate

    listed = arguments.gestures.split(",")
    files = tuple(Path(entry) for entry in listed if entry.endswith(".toml"))
    data = DataSet(
        seed=arguments.seed,
        minutes=arguments.minutes or (6.0 if arguments.protocol == "free" else 29.0),
        protocol=arguments.protocol,
        preset=arguments.preset,
        rate_hz=arguments.rate,
        rows=arguments.rows,
        columns=arguments.columns,
        pitch_mm=arguments.pitch,
        gestures=tuple(
            label_in(Path(entry)) if entry.endswith(".toml") else entry for entry in listed
        ),
        files=files,
    )
    try:
        generate(data, arguments.out, arguments.users, arguments.sessions, arguments.workers, _say)
    except KeyboardInterrupt:
        print("models: interrupted; the same command goes on from here", file=sys.stderr)
        return 1
    print(arguments.out)
    return 0


def _train(arguments: argparse.Namespace) -> int:
    from models.dataset import refuse_test_seed

    refuse_test_seed(arguments.seed, "this training")
    for package in ("torch", "onnx", "tomli_w"):
        if find_spec(package) is None:
            raise ValueError(
                f"training needs {package}; install it with: pip install -e '.[train]'"
            )
    from models.recipe import train_bundle

    train_bundle(
        arguments.out, arguments.sessions, arguments.minutes, arguments.epochs, arguments.seed, _say
    )
    return 0


def _evaluate(arguments: argparse.Namespace) -> int:
    from controller import bundle
    from controller.simulator.presets import PRESETS
    from models import card
    from models.evaluate import report, run, unseen

    path = arguments.bundle or bundle.default_path()
    loaded = bundle.read(path)
    results = {}
    for preset in PRESETS:
        _say(f"{preset}:")
        sessions = unseen(preset, arguments.sessions, arguments.minutes)
        results[preset] = report(run(loaded, sessions, _say), loaded.debounce)
    content = card.text(path.name, loaded, results, arguments.sessions, arguments.minutes)
    print(content)
    if arguments.card:
        arguments.card.write_text(content + "\n", encoding="utf-8")
    return 0


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _count(text: str) -> int:
    value = int(text)
    if not 1 <= value <= 100_000:
        raise argparse.ArgumentTypeError(f"{text} is not between 1 and 100000")
    return value


def _seed(text: str) -> int:
    value = int(text)
    if not 0 <= value < 2**32:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and {2**32 - 1}")
    return value


def _taxels(text: str) -> int:
    value = int(text)
    if not 2 <= value <= 32:
        raise argparse.ArgumentTypeError(f"{text} is not between 2 and 32")
    return value


def _number(least: float, most: float) -> Callable[[str], float]:
    def number(text: str) -> float:
        value = float(text)
        if not least <= value <= most:
            raise argparse.ArgumentTypeError(f"{text} is not between {least:g} and {most:g}")
        return value

    return number


def _length(text: str) -> float:
    value = float(text)
    if not 0.5 <= value <= 600.0:
        raise argparse.ArgumentTypeError(f"{text} minutes are not between 0.5 and 600")
    return value


if __name__ == "__main__":
    sys.exit(main())
