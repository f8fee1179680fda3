"""From folders of recordings to a proven bundle, with its card and its figures beside it."""

import shutil
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from controller.bundles import bundle
from controller.bundles.bundle import Bundle
from controller.bundles.vocabulary import Vocabulary
from controller.console import count
from controller.recognition.debounce import DebounceSettings
from controller.recordings.recording import software
from models import user_files
from models.data import load, touch_images, training_split
from models.data.augment import Symmetry
from models.data.examples import read_training, refuse_test_seed
from models.data.load import Choice, Data
from models.data.recipe import RECIPES, Recipe
from models.data.touch_images import Touches
from models.evaluation import held_out_replay
from models.reports import page
from models.results.training import Training
from models.training import advice, checkpoint, export, train_networks
from models.training import base_bundle as base
from models.training.loop import prepare_torch
from models.training.train_networks import Work

Task = Literal["both", "gesture", "location"]
Say = Callable[[str], None]

PLACE_EPOCHS: Final = 4  # epochs of CNN-2D for each of CNN-3D, where somebody says how many
COMPARED: Final = 2000  # examples on which PyTorch and ONNX Runtime are compared
LONGEST: Final = 4000  # characters of the card's command; a manifest has at most 64 kB
# Until `models tune` finds better: few false alarms at little delay on simulated sessions.
DEBOUNCE: Final = DebounceSettings(smoothing=0.6, on=0.85, off=0.2)


@dataclass(frozen=True, slots=True)
class Request:
    """What somebody asked for.

    Attributes:
        paths: Folders and files.
        out: The bundle.
        task: What is trained; "": whatever the data teach.
        recipe: "default" or "paper".
        labels: Whose labels are learned.
        every: Recordings that fail the check are taken too.
        base: The bundle that gives the network that is not trained; None: the one that ships,
            where it fits.
        split: "session", "user", "time", or "": what fits.
        seed: Of everything random.
        epochs: Of CNN-3D; 0: the recipe's.
        window: Images in a window; 0: those of a second.
        advised: Learning curves are measured, and advice is given.
        bare: The bundle holds the trained gesture network, as ONNX, and nothing else.
        auxiliary: Folders and files with more gestures, which are learned beside the others and
            are no answers of the bundle.
        command: What was typed.
    """

    paths: tuple[Path, ...]
    out: Path
    task: Task | Literal[""] = ""
    recipe: str = "default"
    labels: Choice = "auto"
    every: bool = False
    base: Path | None = None
    split: str = ""
    seed: int = 0
    epochs: int = 0
    window: int = 0
    advised: bool = True
    bare: bool = False
    auxiliary: tuple[Path, ...] = ()
    command: str = ""


def train(request: Request, say: Say) -> Training:
    """Train what was asked for; write the bundle, its card and its figures.

    Args:
        request: What was asked for.
        say: Takes lines of progress.

    Raises:
        ValueError: It cannot be done; one sentence.
    """
    refuse_test_seed(request.seed, "this training")
    user_files.bundle_target(request.out)
    if request.base is not None:
        bundle.read(request.base)  # before anything that takes long
    device = prepare_torch(request.seed)
    recipe = train_networks.epochs(
        RECIPES[request.recipe], request.epochs, PLACE_EPOCHS * request.epochs
    )
    paths = (*request.paths, *request.auxiliary)
    data = load.read(paths, recipe, request.labels, say, window=request.window, every=request.every)
    answers = _answers(request, data.vocabulary)
    people = len({row.user for row in data.rows})
    recipe = replace(recipe, gesture=recipe.gesture.of_people(people))
    found = touch_images.find(data.examples, recipe.averaged, request.seed)
    gesture, location = _tasks(request.task, data, found)
    if request.bare:
        if (gesture, location, request.base) != (True, False, None):
            raise ValueError("--bare is for gestures alone; add --task gesture, leave --with out")
        lender = None
    else:
        lender = base.choose(request.base, data, gesture=gesture, location=location)
    if request.auxiliary and (gesture, location) != (True, False):
        raise ValueError("--auxiliary is for gestures alone; add --task gesture")
    split = training_split.split(data, request.split, request.seed)
    how = recipe.sentences(gesture=gesture, location=location)
    plan = _plan(request, data, split, recipe, how, answers)
    for line in _announcement(plan, data, lender, gesture=gesture, location=location):
        say(line)
    say(f"on {device}, one thread" if device.type == "cpu" else "on a GPU")
    folder = _claim(request, recipe, data)
    work = Work(data, split, recipe, request.seed, device, folder, answers)
    if gesture:
        learned, net = train_networks.gestures(work)
        plan = replace(plan, gesture=learned)
        first, worst = export.gesture_part(net, _windows(data, split, request.seed))
        say(f"PyTorch and ONNX Runtime agree within {worst:.1e}")
    else:
        assert lender is not None
        first = export.parts_of(lender)[0]
    second = _second(lender, data)
    if location:
        placed, place_net = train_networks.places(work, found)
        plan = replace(plan, location=placed)
        second, worst = export.location_part(place_net, _images(found, request.seed))
        say(f"PyTorch and ONNX Runtime agree within {worst:.1e}")
    manifest = _manifest(plan, data, lender, located=bool(second.onnx), gesture=gesture)
    if plan.gesture is not None:
        tried = folder / "tried.orb"
        export.write_bundle(tried, manifest, first, second)
        answered = held_out_replay.replay(bundle.read(tried), data, split)
        plan = replace(plan, gesture=replace(plan.gesture, answered=answered))
        measured = request.advised and not request.auxiliary
        plan = advice.advise(plan, work, measured=measured, say=say)
    export.write_bundle(request.out, manifest, first, second)
    plan = replace(plan, debounce=manifest["debounce"])
    page.write_training(request.out, bundle.read(request.out), plan)
    shutil.rmtree(folder)
    return plan


def _tasks(task: str, data: Data, found: Touches) -> tuple[bool, bool]:
    """Return whether CNN-3D is trained, and CNN-2D."""
    if task in ("both", "location") and not len(found.images):
        raise ValueError(
            "no recording knows where a touch is; record some with: controller teach "
            "--protocol locations, or train --task gesture"
        )
    label = data.examples.label[data.examples.ends]
    several = len(np.unique(label[label >= 0])) > 1
    if task in ("both", "gesture") and not several:
        raise ValueError("all windows are of one class; record others, null among them")
    return task in ("both", "gesture") or not task, task in ("both", "location") or (
        not task and bool(len(found.images))
    )


def _answers(request: Request, vocabulary: Vocabulary) -> int:
    """Return how many classes the bundle answers: all that are not auxiliary."""
    if not request.auxiliary:
        return len(vocabulary.labels)
    own = read_training(request.paths).labels
    if own != vocabulary.labels[: len(own)]:
        raise ValueError(
            f"the recordings have the labels {', '.join(own)}, those with auxiliary gestures "
            f"{', '.join(vocabulary.labels)}; they shall begin alike"
        )
    return len(own)


def _plan(
    request: Request,
    data: Data,
    split: training_split.Split,
    recipe: Recipe,
    how: Sequence[str],
    answers: int,
) -> Training:
    """Return what is known before anything is learned."""
    vocabulary, shape = data.vocabulary, data.examples.images.shape[1:]
    return Training(
        name=request.out.name,
        command=request.command,
        software=software(),
        recipe=recipe.name,
        how=tuple(how),
        rows=shape[0],
        columns=shape[1],
        pitch_mm=data.pitch_mm,
        rate_hz=data.settings.rate_hz,
        unit=data.unit,
        labels=vocabulary.labels[:answers],
        vocabulary=vocabulary.name,
        split=split.words,
        symmetries=tuple(Symmetry.of(vocabulary, *shape).sentences(vocabulary.labels))
        if recipe.gesture.augmentation.symmetric
        else (),
        sessions=tuple(
            replace(row, held_out=bool(held))
            for row, held in zip(data.rows, split.held, strict=True)
        ),
        classes=advice.counts(data, split)[:answers],
        gesture=None,
        location=None,
        notes=data.notes,
    )


def _announcement(
    plan: Training, data: Data, lender: Bundle | None, *, gesture: bool, location: bool
) -> Sequence[str]:
    """Return what will be done, in lines."""
    minutes = sum(row.seconds for row in plan.sessions) / 60.0
    doubtful = sum(row.verdict != "good" for row in plan.sessions)
    labellers = sorted({row.labeller for row in plan.sessions})
    lines = [
        *plan.notes,
        f"{count(len(plan.sessions), 'recording')}, {count(round(minutes), 'minute')}, "
        f"{plan.rows}×{plan.columns} taxels at {plan.rate_hz:g} Hz in {plan.unit}; "
        f"{' and '.join(labellers)} labels",
    ]
    if auxiliary := data.vocabulary.labels[len(plan.labels) :]:
        lines.append(f"learned beside the others, and left out in the end: {', '.join(auxiliary)}")
    if doubtful:
        lines.append(f"doubtful: {doubtful}; controller recordings check says why")
    lines += [
        f"  {row.label}: {f'{row.examples} examples, ' if row.examples else ''}{row.seconds:.0f} s"
        for row in plan.classes
    ]
    lines += [plan.split, *plan.symmetries]
    lines.append(f"recipe {plan.recipe}")
    lines += [f"  {line}" for line in plan.how]
    if lender is not None:
        which = "gesture" if location and not gesture else "location"
        lines.append(f"the {which} network is that of the bundle {lender.hash[:12]}")
    elif not location:
        lines.append("nothing tells where a touch is, and the bundle will not say")
    return lines


def _claim(request: Request, recipe: Recipe, data: Data) -> Path:
    """Return the folder of checkpoints: of this training, or new.

    Raises:
        CheckpointError: It is another training's.
    """
    folder = request.out.with_name(f"{request.out.name}.training")
    of = (
        *(recipe, data.digest, data.vocabulary, data.settings, software()),
        *(request.task, request.labels, request.split, request.seed, request.base),
        request.auxiliary,
        request.every,
    )
    return checkpoint.claim(folder, "training.npz", of, "training")


def _windows(data: Data, split: training_split.Split, seed: int) -> Any:
    """Return real windows for the comparison of the engines."""
    held = split.windows.check if len(split.windows.check) else split.windows.train
    ends = data.examples.ends[held]
    rng = np.random.default_rng((seed, 4))
    return data.examples.windows(rng.choice(ends, min(COMPARED, len(ends)), replace=False))


def _images(found: Touches, seed: int) -> Any:
    rng = np.random.default_rng((seed, 5))
    return found.images[rng.permutation(len(found.images))[:COMPARED]]


def _second(lender: Bundle | None, data: Data) -> export.Part:
    if lender is not None:
        return export.parts_of(lender)[1]
    return export.no_location(*data.examples.images.shape[1:])


def _manifest(
    plan: Training, data: Data, lender: Bundle | None, *, located: bool, gesture: bool
) -> dict[str, Any]:
    """Return what bundle.toml says."""
    made = {
        "software": plan.software,
        "command": textwrap.shorten(plan.command, LONGEST, placeholder=" ..."),
        "data": f"{count(len(plan.sessions), 'recording')}, SHA-256 {data.digest[:16]}",
        "split": plan.split,
    }
    if auxiliary := data.vocabulary.labels[len(plan.labels) :]:
        made["auxiliary"] = ", ".join(auxiliary)
    if lender is not None:
        made["with"] = lender.hash[:16]
    if gesture or lender is None:
        labels, settings, debounce = plan.labels, data.settings, DEBOUNCE
        asked = base.mapping(data.vocabulary, lender, located=located)
        table = {label: asks for label, asks in asked.items() if label in labels}
    else:
        labels, settings, debounce = lender.labels, lender.preprocess, lender.debounce
        table = base.table_of(lender)
    content = export.manifest(
        labels, (plan.rows, plan.columns), plan.pitch_mm, settings, debounce, table, made
    )
    assert content["debounce"] == asdict(debounce)
    far = plan.location.spread if plan.location else lender and lender.spread
    if far is not None:
        card = content.pop("card")  # it stands last
        content |= {"location": asdict(far), "card": card}
    return content
