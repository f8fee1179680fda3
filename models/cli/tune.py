"""`models tune`: choose when a gesture counts, on labelled recordings."""

import argparse
import shlex
import sys
from pathlib import Path
from typing import Final

from controller.shared.arguments import number
from models.cli import _options as options

SUMMARY: Final = "choose when a gesture counts, on labelled recordings"
DESCRIPTION: Final = (
    "Replay labelled recordings over the debouncer's thresholds, draw what is lost against how "
    "late and how often falsely a gesture is answered, and write the cheapest choice into a new "
    "bundle. Report on other recordings (models evaluate): a choice flatters what it was made on."
)
EXAMPLE: Final = (
    "Try it (a minute): models simulate --out data --users 4 --sessions 1, then models tune "
    "models/orbtouch.orb data --out tuned.orb"
)

# Option, default, greatest value, metavar and meaning of each part of the goal, in order.
GOAL: Final = (
    ("lost", 1.0, 1e6, "W", "cost of each per cent of F1 that is missing"),
    ("alarm", 5.0, 1e6, "W", "cost of one false alarm in an idle minute"),
    ("wait", 1.0, 1e6, "W", "cost of a second of latency"),
    ("latest", 0.42, 60.0, "S", "greatest median latency, seconds"),
    ("alarms", 0.02, 1000.0, "N", "most false alarms in an idle minute"),
)
SEEN: Final = 0.005  # share of gestures lost that recordings should be able to show


def add(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add = parser.add_argument
    add("bundle", type=Path, help="bundle to tune")
    add("data", type=Path, nargs="+", metavar="DIR", help="labelled recordings, or folders of them")
    add("--out", type=Path, metavar="FILE", help="bundle to write (default: only show)")
    options.take_labels(
        parser, "source of the labels (default: auto: the truth, else people's labels)"
    )
    for name, default, most, metavar, meaning in GOAL:
        words, kind = f"{meaning} (default: {default:g})", number(0.0, most)
        add(f"--{name}", type=kind, default=default, metavar=metavar, help=words)
    add("--json", type=Path, metavar="FILE", help="write what was found as JSON")
    words = "the report that it is added to (default: beside OUT)"
    add("--html", type=Path, metavar="FILE", help=words)


def run(arguments: argparse.Namespace) -> int:
    """Choose, show, and write."""
    from dataclasses import replace

    from controller.bundles import bundle
    from controller.shared.errors import count
    from models.data.examples import read_training
    from models.data.ground_truth import GroundTruth
    from models.evaluation import position_error
    from models.evaluation.replay import Batched
    from models.evaluation.replay import run as play
    from models.evaluation.tune import Goal, spread, tune, write
    from models.reports import markdown, tables
    from models.results import storage

    if arguments.out:
        storage.bundle_target(arguments.out)
        options.require("writing a bundle", "tomli_w")
    page_of = arguments.html or (arguments.out and arguments.out.with_suffix(".html"))
    if arguments.json:
        storage.target(arguments.json)
    if page_of:
        options.require("a report", "jinja2", "matplotlib")
        from models.reports import page

        page.read(page_of)  # a file that is no report is refused before the work begins
    loaded = bundle.read(arguments.bundle)
    recordings = read_training(arguments.data)  # seeds that are for tests are refused
    options.say_each(recordings.notes)
    networks, streams = Batched(loaded), []
    for survey, recording in zip(recordings.surveys, recordings, strict=True):
        truth = GroundTruth.of(recording, loaded.labels, survey.path.stem, arguments.labels)
        streams.append(
            play(replace(loaded, spread=position_error.BARE), networks, recording, truth)
        )
        options.say(f"{survey.path.stem}: {count(len(truth.events), 'event')}")
    goal = Goal(*(getattr(arguments, name) for name, *_ in GOAL))
    command = f"models {shlex.join(sys.argv[1:])}"
    found = tune(arguments.bundle.name, loaded.labels, loaded.debounce, streams, goal, command)
    on = f"{count(found.sessions, 'recording')} with {count(found.events, 'event')}"
    idle = count(round(found.idle_minutes), "idle minute")
    print(f"{on} and {idle}; {found.tried} points, {len(found.front)} of them on the front")
    print(markdown.table(tables.thresholds(found)))
    print(found.goal)
    if (far := spread(streams)) is not None:
        print(f"places are {far.floor:.3f} grid units off without noise, and "
              f"{far.noise:.1f} times as far as their images are noisy")  # fmt: skip
    if (unseen := 3.0 / found.events) > SEEN:
        print(f"losses below {unseen:.1%} cannot be seen in {count(found.events, 'event')}: "
              "record more before you make it faster")  # fmt: skip
    if arguments.json:
        storage.write_json(arguments.json, found)
    if page_of:
        page.write(page_of, page.ReportData(tuning=found))
    if arguments.out:
        entry = f"on {on}; {found.goal}"
        made = write(arguments.out, arguments.bundle, found.chosen.settings, entry, far)
        options.say(f"{arguments.out} is written, SHA-256 {made.hash[:16]}…")
    return 0
