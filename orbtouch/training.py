"""Training of networks from recordings, with the words of `models train`."""

import io
import logging
import re
import shutil
from collections.abc import Iterable, Sequence
from contextlib import redirect_stderr
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from controller.bundles import bundle as bundles
from controller.shared.errors import UserError, how_to_install
from models.data.examples import CHOICES, Choice
from models.data.recipe import RECIPES
from models.data.splits import SPLITS
from models.results import storage
from models.results.evaluation import Figure
from models.results.training import Epoch
from models.training.request import Request, TaskName
from orbtouch import checks
from orbtouch.networks import Network, load_network
from orbtouch.recordings import Recording

Paths = Path | str | Sequence[Path | str]
log = logging.getLogger("orbtouch")


@dataclass(frozen=True)
class Training:
    """Result of a training; both tables are by network, "gesture" and "location".

    Attributes:
        network: What was trained.
        scores: On what was held out: share of right windows, or mean error of places, grid units.
        curve: Loss and score of each epoch.
        advice: Next steps, in sentences, the most urgent first.
    """

    network: Network
    scores: dict[str, Figure]
    curve: dict[str, tuple[Epoch, ...]]
    advice: tuple[str, ...]


def train(
    paths: Paths,
    out: Path | str,
    *,
    task: TaskName = "",
    recipe: str = "",
    labels: Choice = "auto",
    all: bool = False,
    window: int = 0,
    seed: int = 0,
    split: str = "",
    with_: Path | str | None = None,
    from_: Path | str | None = None,
    epochs: int | None = None,
    gestures: Sequence[str] = (),
    auxiliary: Paths = (),
    others: Paths = (),
    declared: bool = False,
    resume: Literal["auto", "new"] = "auto",
) -> Training:
    """Train networks from recordings, write a bundle with its card and report, and return both.

    Options are those of `models train` (docs/training.md); progress is logged as `orbtouch`.

    Args:
        paths: Recordings, or folders of them, of one sensor.
        out: Bundle to write, NAME.orb.
        task: "gesture", "location", "user", "contact" or "state"; "": what the recordings have.
        recipe: "default", "play", "people" or "paper"; "": by the sensor.
        labels: Source of the labels.
        all: Learn from recordings that fail the check, too.
        window: Images in a window; 0: those of a second.
        seed: Of everything random.
        split: What is held out: "session", "user" or "time"; "": sessions, of few the ends.
        with_: Bundle of the network that is not trained; None: the one that ships.
        from_: Bundle to start from; None: random weights.
        epochs: Passes over the examples; None: the recipe's, 0: choose thresholds of `from_`.
        gestures: Those that identify users.
        auxiliary: Recordings with more gestures, learned beside the others.
        others: Recordings of strangers.
        declared: Try no symmetries beside those of gestures.toml.
        resume: "auto" goes on with an interrupted training of the same data and options, else
            begins anew; "new" always begins anew.

    Raises:
        Error: An option is unfit, the [train] extra is missing, or nothing can be learned.
    """
    checks.one_of(task, "task", get_args(TaskName))
    checks.one_of(recipe, "recipe", ("", *RECIPES))
    checks.one_of(labels, "labels", CHOICES)
    checks.one_of(split, "split", ("", *SPLITS))
    checks.one_of(resume, "resume", ("auto", "new"))
    checks.whole(seed, "seed", 0, 2**32 - 1)
    checks.window(window)
    checks.whole(0 if epochs is None else epochs, "epochs", 0, 100_000)
    places, more, strangers = map(_paths, (paths, auxiliary, others))
    given = (places, checks.path(out), task, recipe, labels, all, window, seed, split)
    names = [gestures] if isinstance(gestures, str) else gestures
    base, start = (None if one is None else checks.path(one) for one in (with_, from_))
    request = Request(*given, base, start, epochs, tuple(names), more, strangers, declared)
    try:
        request.check()
        storage.bundle_target(request.out)
        for path in filter(None, (base, start)):
            bundles.read(path)
        return _trained(request, resume)
    except ValueError as error:  # words of the command line are keywords here
        raise UserError(re.sub(r"--(\w+)", r"\1", str(error))) from None


class _Progress(io.StringIO):
    """Standard error of a training, whose lines are logged."""

    def write(self, text: str) -> int:
        """Log a line."""
        if line := text.strip():
            log.info("%s", line)
        return len(text)


def _trained(request: Request, resume: str) -> Training:
    checks.needed("torch", "training", how_to_install("train"))
    from models.training import train as driver
    from models.training.checkpoint import CheckpointError

    folder = driver.checkpoints(request)
    if resume == "new":
        shutil.rmtree(folder, ignore_errors=True)
    if request.epochs == 0:
        driver.choose_thresholds(request, log.info)
        return Training(load_network(request.out), {}, {}, ())
    try:
        with redirect_stderr(_Progress()):
            made = driver.train(request, log.info)
    except CheckpointError:
        log.warning("the checkpoints in %s are of another training; it begins anew", folder)
        return _trained(request, "new")
    parts = {name: getattr(made, name, None) for name in ("gesture", "location")}
    found = {name: part for name, part in parts.items() if part is not None}
    scores = {name: part.honesty.figure for name, part in found.items()}
    curve = {name: part.epochs for name, part in found.items()}
    return Training(load_network(request.out), scores, curve, getattr(made, "advice", ()))


def _paths(given: Paths) -> tuple[Path, ...]:
    """Return one path or several; Error for anything else."""
    if isinstance(given, Iterable) and not isinstance(given, str | Recording):
        return tuple(map(checks.path, given))
    return (checks.path(given),)
