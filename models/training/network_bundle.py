"""Bundles of newly trained gesture and location networks."""

import textwrap
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import torch

from controller.bundles import bundle, container
from controller.bundles.bundle import Bundle
from controller.bundles.vocabulary import Vocabulary
from controller.recognition.debounce import DebounceSettings
from controller.recognition.mapping import NONE
from controller.recognition.touch_input import TouchInput
from controller.recordings.recording import software
from controller.shared import files
from controller.shared.aliases import Say
from controller.shared.errors import count
from models.data import splits, touch_images
from models.data.augment import Symmetry
from models.data.examples import read_training
from models.data.load import Data
from models.data.recipe import Recipe
from models.data.splits import Split
from models.data.touch_images import Touches
from models.evaluation import advice, evaluate
from models.reports import cards, figures
from models.results.evaluation import numbers
from models.results.training import Training
from models.training import export, symmetry_search, transfer
from models.training.gesture_task import train_gestures
from models.training.location_task import train_locations
from models.training.loop import TrainingJob
from models.training.networks import gesture_net, location_net
from models.training.request import Request
from models.training.transfer import Start

LONGEST: Final = 4000  # characters of the card's command; a manifest has at most 64 kB
# Until `models train --epochs 0` finds better: few false alarms and little delay in simulation.
DEBOUNCE: Final = DebounceSettings(smoothing=0.6, on=0.85, off=0.2)


@dataclass(frozen=True, slots=True)
class NetworkPlan:
    """A training of CNN-3D, CNN-2D or both."""

    request: Request  # its options
    data: Data  # examples
    split: Split  # split of the examples
    recipe: Recipe  # training recipe
    touches: Touches  # images of touches
    gesture: bool  # CNN-3D is trained
    location: bool  # CNN-2D is trained
    lender: Bundle | None  # bundle of the network that is not trained; None: there is none
    answers: int  # classes that the bundle answers; further ones are auxiliary
    start: Start  # weights of another bundle

    @property
    def auxiliary(self) -> tuple[str, ...]:
        """Labels that are learned and not answered."""
        return self.data.vocabulary.labels[self.answers :]

    @classmethod
    def of(cls, request: Request, data: Data, base: Bundle, say: Say) -> "NetworkPlan":
        """Check a training, and announce it; ValueError, one sentence, if it cannot be done."""
        answers = _answers(request, data)
        recipe = request.networks(orb=data.settings.normalise != "difference")
        users = len({row.user for row in data.rows})
        recipe = replace(recipe, gesture=recipe.gesture.of_people(users))
        found = touch_images.find(data.examples, recipe.averaged, request.seed)
        gesture, location = _networks(request.task, data, found)
        alone = gesture and not location
        if request.auxiliary and not alone:
            raise ValueError("--auxiliary is for gestures alone; add --task gesture")
        lender = _lender(request, base, data, gesture, location)
        split = splits.split_windows(data, request.split, request.seed)
        start = _start(request.start, data, recipe, gesture, location)
        made = cls(request, data, split, recipe, found, gesture, location, lender, answers, start)
        for line in _announcement(made, _expected(made)):
            say(line)
        return made

    def train(self, device: torch.device, folder: Path, say: Say) -> Training:
        """Train the networks; write the bundle, its card and its report."""
        return self._searched(device, say)._train(device, folder, say)

    def _searched(self, device: torch.device, say: Say) -> "NetworkPlan":
        """Return the plan with the symmetries found by trial, where none are declared."""
        if self.request.declared or not self.gesture:
            return self
        train, seed = self.split.windows.train, self.request.seed
        data, words = symmetry_search.declared(self.data, train, self.recipe.gesture, seed, device)
        if words:
            say(f"no gestures.toml declares symmetries; judged on all, in three parts: {words}")
            say("declare there what holds, or try none with --declared")
        return replace(self, data=data)

    def _train(self, device: torch.device, folder: Path, say: Say) -> Training:
        """Train the networks with the symmetries that are known."""
        request, data, split, lender = self.request, self.data, self.split, self.lender
        shape = data.examples.images.shape[1:]
        result = _expected(self)
        job = TrainingJob(
            data, split, self.recipe, request.seed, device, folder, self.answers, self.start
        )
        gesture, location = None, export.no_location(*shape)
        if lender is not None:
            gesture, location = export.networks_of(request.base or bundle.default_path())
        if self.gesture:
            scored, net = train_gestures(job)
            result = replace(result, gesture=scored)
            gesture = export.export_gestures(
                net, export.compared_windows(data, split, request.seed)
            )
            gesture.parts[container.REHEARSAL] = export.rehearsal(
                gesture.parts[container.EMBEDDING],
                data.examples,
                data.examples.ends[split.windows.train],
                self.answers,
                request.seed,
            )
        if self.location:
            located, net = train_locations(job, self.touches)
            result = replace(result, location=located)
            location = export.export_location(
                net, export.compared_images(self.touches, request.seed), self.recipe.location.touch
            )
        assert gesture is not None
        manifest = _manifest(self, result, located=bool(location.parts[container.LOCATION]))
        if result.gesture is not None:
            tried = folder / "tried.orb"
            export.write_bundle(tried, manifest, gesture, location)
            answered, unanswered = evaluate.replay_held_out(bundle.read(tried), data, split)
            scores = replace(result.gesture, answered=answered, unanswered=unanswered)
            result = replace(result, gesture=scores)
            result = advice.advise(result)
        export.write_bundle(request.out, manifest, gesture, location)
        loaded = bundle.read(request.out)
        result = replace(result, debounce=numbers(loaded.debounce))
        drawn = figures.draw_training(result, request.out)
        cards.write(request.out, cards.training(loaded, result, drawn), result)
        return result


def _networks(task: str, data: Data, found: Touches) -> tuple[bool, bool]:
    """Return whether CNN-3D is trained, and CNN-2D; ValueError if the data are not enough."""
    located = bool(len(found.images))
    if task == "location" and not located:
        raise ValueError(
            "no recording has the place of a touch; record some with: controller teach "
            "--places, or train --task gesture"
        )
    label = data.examples.label[data.examples.ends]
    if task != "location" and len(np.unique(label[label >= 0])) < 2:
        raise ValueError("all windows are of one class; record others, null among them")
    return task != "location", task == "location" or (not task and located)


def _lender(
    request: Request, base: Bundle, data: Data, gesture: bool, location: bool
) -> Bundle | None:
    """Return the bundle of the network that is not trained; None if there is none."""
    if gesture and location:
        if request.base is not None:
            raise ValueError("--with lends a network that is not trained, and here both are")
        return None
    why = _misfit(base, data, location=location)
    if why and (location or request.base is not None):
        raise ValueError(
            f"{request.base or 'the bundle that ships'} cannot lend its network: {why}; name "
            "another with --with, or train both without --task"
        )
    return None if why else base


def _start(path: Path | None, data: Data, recipe: Recipe, gesture: bool, location: bool) -> Start:
    """Return the weights that the networks start from, read from a bundle; None: random."""
    if path is None:
        return Start()
    examples, labels, loaded = data.examples, data.vocabulary.labels, bundle.read(path)
    shape = examples.window, *examples.images.shape[1:]
    if shape != (loaded.window, loaded.rows, loaded.columns):
        raise ValueError(
            f"{path} has windows of {loaded.window} images of {loaded.rows}×{loaded.columns} "
            f"taxels, the recordings {shape[0]} of {shape[1]}×{shape[2]}; --from takes a bundle of "
            "the same sensor and rate"
        )
    return transfer.start(
        loaded,
        labels,
        gesture_net(shape, len(labels), recipe.gesture) if gesture else None,
        location_net(recipe.location.touch.shape(*shape[1:]), recipe.location)
        if location
        else None,
    )


def _misfit(lender: Bundle, data: Data, *, location: bool) -> str:
    """Return why a bundle's other network does not fit; "": it does."""
    own, new = lender.preprocess.plain, data.settings
    theirs = lender.rows, lender.columns, lender.pitch_mm, own.normalise, own.scale
    ours = *data.examples.images.shape[1:], data.pitch_mm, new.normalise, new.scale
    if theirs != ours or (location and own != new):
        return "it is for another sensor than the recordings', or makes images in another way"
    return "" if location or lender.locates else "it has none"


def _mapping(vocabulary: Vocabulary, lent: dict[str, Any], *, located: bool) -> dict[str, Any]:
    """Return the mapping of a new bundle: as the vocabulary has it, else as the base has it.

    If the bundle does not locate touches, gestures whose command depends on the place do nothing.
    """
    table = {label: lent[label] for label in vocabulary.labels if label in lent}
    table |= vocabulary.table
    return {
        label: NONE if isinstance(rules, list) and len(rules) > 1 and not located else rules
        for label, rules in table.items()
    }


def _lent_mapping(base: Path | None) -> dict[str, Any]:
    """Return a bundle's mapping as its manifest has it; None is the bundle that ships."""
    parts = container.unpack(files.read_bytes(base or bundle.default_path(), container.MAX_BYTES))
    return dict(container.manifest(parts[container.MANIFEST])["mapping"])


def _answers(request: Request, data: Data) -> int:
    """Return how many classes the bundle answers: all but the auxiliary ones, the last."""
    labels = data.vocabulary.labels
    if not request.auxiliary:
        return len(labels)
    own = read_training(request.paths).labels
    if own != labels[: len(own)]:
        raise ValueError(
            f"the recordings have the labels {', '.join(own)}, those with auxiliary gestures "
            f"{', '.join(labels)}; they shall begin alike"
        )
    return len(own)


def _expected(plan: NetworkPlan) -> Training:
    """Return the result as far as it is known before anything is learned."""
    data, recipe = plan.data, plan.recipe
    vocabulary, shape = data.vocabulary, data.examples.images.shape[1:]
    rows = zip(data.rows, plan.split.held, strict=True)
    symmetry = Symmetry.of(vocabulary, *shape).sentences(vocabulary.labels)
    return Training(
        name=plan.request.out.name,
        command=plan.request.command,
        software=software(),
        recipe=recipe.name,
        how=(*recipe.sentences(gesture=plan.gesture, location=plan.location), *plan.start.lines),
        rows=shape[0],
        columns=shape[1],
        pitch_mm=data.pitch_mm,
        rate_hz=data.settings.rate_hz,
        unit=data.unit,
        labels=vocabulary.labels[: plan.answers],
        vocabulary=vocabulary.name,
        split=plan.split.words,
        symmetries=tuple(symmetry) if recipe.gesture.augmentation.symmetric else (),
        sessions=tuple(replace(row, held_out=bool(held)) for row, held in rows),
        classes=advice.counts(data, plan.split)[: plan.answers],
        gesture=None,
        location=None,
        notes=data.notes,
    )


def _announcement(plan: NetworkPlan, result: Training) -> Sequence[str]:
    """Return the announcement of the training, in lines."""
    minutes = sum(row.seconds for row in result.sessions) / 60.0
    doubtful = sum(row.verdict != "good" for row in result.sessions)
    labellers = sorted({row.labeller for row in result.sessions})
    lines = [
        *result.notes,
        f"{count(len(result.sessions), 'recording')}, {count(round(minutes), 'minute')}, "
        f"{result.rows}×{result.columns} taxels at {result.rate_hz:g} Hz in {result.unit}; "
        f"{' and '.join(labellers)} labels",
    ]
    if plan.auxiliary:
        words = ", ".join(plan.auxiliary)
        lines.append(f"learned beside the others, and left out in the end: {words}")
    if doubtful:
        lines.append(f"doubtful: {doubtful}; controller recordings says why")
    lines += [
        f"  {row.label}: {f'{row.examples} examples, ' if row.examples else ''}{row.seconds:.0f} s"
        for row in result.classes
    ]
    lines += [result.split, *result.symmetries, f"recipe {result.recipe}"]
    lines += [f"  {line}" for line in result.how]
    if plan.lender is not None:
        which = "location" if plan.gesture else "gesture"
        lines.append(f"the {which} network is that of the bundle {plan.lender.hash[:12]}")
    elif not plan.location:
        mapping = _mapping(plan.data.vocabulary, {}, located=False)
        silent = " or ".join(label for label, rules in mapping.items() if rules == NONE)
        words = f"; {silent} has no command then, unless --mapping gives one" if silent else ""
        lines.append(f"no recording has a touch's place: the bundle will not locate touches{words}")
    return lines


def _manifest(plan: NetworkPlan, result: Training, *, located: bool) -> dict[str, Any]:
    """Return the content of bundle.toml."""
    data, lender = plan.data, plan.lender
    made = {
        "software": result.software,
        "command": textwrap.shorten(result.command, LONGEST, placeholder=" ..."),
        "data": f"{count(len(result.sessions), 'recording')}, SHA-256 {data.digest[:16]}",
        "split": result.split,
    }
    if plan.auxiliary:
        made["auxiliary"] = ", ".join(plan.auxiliary)
    if plan.request.start is not None:
        made["from"] = bundle.read(plan.request.start).hash[:16]
    if lender is not None:
        made["with"] = lender.hash[:16]
    if plan.gesture or lender is None:
        labels, settings, debounce = result.labels, data.settings, DEBOUNCE
        lent = _lent_mapping(plan.request.base) if lender is not None else {}
        mapping = _mapping(data.vocabulary, lent, located=located)
        mapping = {label: rules for label, rules in mapping.items() if label in labels}
    else:
        labels, settings, debounce = lender.labels, lender.preprocess, lender.debounce
        mapping = _lent_mapping(plan.request.base)
    spread = result.location.spread if result.location else lender and lender.spread
    accuracy = {} if spread is None else {"location": asdict(spread)}
    touch = plan.recipe.location.touch if plan.location else lender.touch if lender else None
    if touch not in (None, TouchInput()):
        accuracy["touch"] = asdict(touch)
    return {
        "format": container.FORMAT_VERSION,
        "labels": list(labels),
        "rows": result.rows,
        "columns": result.columns,
        "pitch_mm": result.pitch_mm,
        "rate_hz": settings.rate_hz,
        "window": settings.window,
        "preprocess": asdict(settings),
        "debounce": asdict(debounce),
        "mapping": mapping,
        **accuracy,
        "card": made,
    }
