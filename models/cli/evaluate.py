"""`models evaluate`: judge a bundle on sessions that it never saw."""

import argparse
import shlex
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from controller.shared import errors
from models.cli import _options as options

if TYPE_CHECKING:
    from controller.bundles.bundle import Bundle
    from controller.recordings.recording import Recording

DESCRIPTION: Final = (
    "Play recordings through a bundle as the device would, and count what it answers: confusion, "
    "event metric, false alarms, latency, calibration and places, by session and by user, with "
    "95 % intervals over the sessions. Without recordings, new people on new orbs are simulated."
)
EXAMPLE: Final = "Try it (ten seconds): models evaluate --sessions 2 --minutes 2"

# Returns the named sessions of a set.
Played = Callable[[], "Iterable[tuple[str, Recording]]"]
Sets = tuple[dict[str, Played], tuple[str, ...]]  # by name, and notes for the report


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add("bundle", type=Path, nargs="?", help="default: the one that ships")
    add("data", type=Path, nargs="*", metavar="DIR", help="recordings, or folders of them")
    options.take(parser, "labels")
    add("--sessions", type=options.count, default=20, help="simulated, a preset (default: 20)")
    add("--minutes", type=options.minutes, default=6.0, help="of each of them (default: 6)")
    words = "source of the simulated touches (default: person)"
    add("--hand", choices=("person", "pointer"), default="person", help=words)
    add("--json", type=Path, metavar="FILE", help="write the figures as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Judge the bundle."""
    from controller.bundles import bundle
    from models.evaluation.evaluate import evaluate, summarise
    from models.reports import cards
    from models.results import storage
    from models.results.evaluation import Evaluation, numbers

    if arguments.json:
        storage.target(arguments.json)
    path = arguments.bundle or bundle.default_path()
    loaded = bundle.read(path)
    left_out: list[str] = []
    data = arguments.data
    sets, notes = _recorded(data, left_out) if data else _simulated(loaded, arguments)
    results = []
    for name, played in sets.items():
        errors.say(f"{name}:")
        tallies = evaluate(loaded, played(), errors.say, arguments.labels, left_out)
        results.append(summarise(name, loaded.labels, tallies))
    found = Evaluation(
        bundle=path.name,
        hash=loaded.hash,
        card={key: str(value) for key, value in loaded.card.items()},
        command=f"models {shlex.join(sys.argv[1:])}",
        labels=loaded.labels,
        debounce=numbers(loaded.debounce),
        results=tuple(results),
        notes=(*notes, *dict.fromkeys(left_out)),
    )
    print(cards.evaluation(found))
    for result in results:
        errors.say("\n".join([f"{result.name}:", *map(str, result.verdict)]))
    if arguments.json:
        storage.write_json(arguments.json, found)
    return 0


def _recorded(data: Sequence[Path], left_out: list[str]) -> Sets:
    """Return the recordings of each folder as a set.

    Files that cannot be read are `left_out`, each with a sentence.
    """
    from controller.recordings import reader
    from models.data import examples

    def played(files: Sequence[Path]) -> "Iterable[tuple[str, Recording]]":
        return ((file.stem, reader.load(file)) for file in files)

    found = examples.recording_sets(data, left_out)
    for line in left_out:
        errors.say(line)
    return {name: partial(played, files) for name, files in found.items()}, ()


def _simulated(loaded: "Bundle", arguments: argparse.Namespace) -> Sets:
    """Return simulated people on both presets' orbs, and a note on them."""
    from controller.simulator.orb import PRESETS
    from models.data.simulate import EVALUATE_SEED, DataSet

    count = arguments.sessions
    sets: dict[str, Played] = {}
    for preset in PRESETS:
        people = DataSet.of(loaded, preset, EVALUATE_SEED, arguments.minutes, arguments.hand)
        sets[preset] = partial(people.sessions, count, count)
    who = "a mouse's touches" if arguments.hand == "pointer" else "other people"
    note = (
        f"Simulated sessions of {arguments.minutes:g} minutes that no training accepts: {who} on "
        "other orbs. Simulated recordings say nothing about a physical orb. "
        "This card is printed by `models evaluate`."
    )
    return sets, (note,)
