"""Train the networks and judge them: the command line of the training machine."""

import argparse
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

DESCRIPTION = "Train the orb's networks from simulated sessions, and judge bundles on unseen ones."
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
        "bundle. About ten minutes on one core with the defaults.",
        epilog="Try it (one minute): models train --sessions 6 --minutes 3 --epochs 4 --out my.orb",
    )
    train.add_argument("--out", type=Path, required=True, metavar="FILE", help="bundle to write")
    train.add_argument("--sessions", type=_count, default=60, help="to train on (default: 60)")
    train.add_argument("--minutes", type=_length, default=6.0, help="of each (default: 6)")
    train.add_argument("--epochs", type=_count, default=16, help="of CNN-3D (default: 16)")
    train.add_argument("--seed", type=int, default=0, help="of everything random (default: 0)")
    train.set_defaults(run=_train)
    evaluate = commands.add_parser(
        "evaluate",
        help="judge a bundle on unseen sessions",
        description="Play simulated sessions whose seeds training never saw through a bundle.",
        epilog=EXAMPLE,
    )
    evaluate.add_argument("bundle", type=Path, nargs="?", help="default: the one that ships")
    evaluate.add_argument("--sessions", type=_count, default=20, help="default: 20")
    evaluate.add_argument("--minutes", type=_length, default=6.0, help="of each (default: 6)")
    evaluate.add_argument("--card", type=Path, metavar="FILE", help="write the figures as a card")
    evaluate.set_defaults(run=_evaluate)
    return parser


def _train(arguments: argparse.Namespace) -> int:
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
    from controller.simulator.session import EVALUATION, simulate
    from models import card
    from models.evaluate import report, run

    path = arguments.bundle or bundle.default_path()
    loaded = bundle.read(path)
    sessions = (
        simulate(seed, arguments.minutes, domain=EVALUATION, pointer=seed % 4 == 3)
        for seed in range(arguments.sessions)
    )
    result = report(run(loaded, sessions, _say), loaded.debounce)
    print(card.text(path.name, loaded, result, arguments.sessions, arguments.minutes))
    if arguments.card:
        content = card.text(path.name, loaded, result, arguments.sessions, arguments.minutes)
        arguments.card.write_text(content + "\n", encoding="utf-8")
    return 0


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _count(text: str) -> int:
    value = int(text)
    if not 1 <= value <= 100_000:
        raise argparse.ArgumentTypeError(f"{text} is not between 1 and 100000")
    return value


def _length(text: str) -> float:
    value = float(text)
    if not 0.5 <= value <= 600.0:
        raise argparse.ArgumentTypeError(f"{text} minutes are not between 0.5 and 600")
    return value


if __name__ == "__main__":
    sys.exit(main())
