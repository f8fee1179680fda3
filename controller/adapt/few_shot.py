"""One lesson: a bundle and examples in, a bundle that knows more out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import tomli_w
from numpy.typing import NDArray

from controller import console
from controller.adapt import fit_head, head, rehearsal
from controller.adapt.examples import EVERYBODY, NULL_LABEL, Example, vary
from controller.adapt.head import FormError
from controller.adapt.rehearsal import Rehearsal, RehearsalError
from controller.bundles import bundle as bundles
from controller.bundles import users_table
from controller.bundles.bundle import Bundle, BundleError
from controller.bundles.inference import engines, onnx_reader
from controller.errors import TroubleError

GESTURE: Final = bundles.CONTENT[0]
MOST_EXAMPLES: Final = 200  # in a bundle, all lessons together
COPIES: Final = 240  # windows' worth of copies of a label's examples together
REHEARSED: Final = 3  # copies of what is rehearsed
SHARE: Final = 0.185  # what a label's examples weigh without noise, all that is rehearsed being 1
NOISY: Final = 0.03  # as much noise halves it: the old gestures are nearer to any other then
AROUND: Final = 1.0  # what surrounds them, times that
LEAST_KEPT: Final = 0.9  # of the rehearsed gestures, taken for the same ones as before
_SEED: Final = 0  # the same lesson gives the same bundle
GOLDEN_EACH: Final = 4  # windows of an example that become golden


# Windows (n, window, rows, columns), and of each: whether the touch lies within, class, weight.
_ExampleWindows = tuple[
    NDArray[np.float32], NDArray[np.bool_], NDArray[np.int64], NDArray[np.float64]
]


class AdaptError(TroubleError, ValueError):
    """It cannot be learned like this; the message is one sentence with the reason."""


@dataclass(frozen=True)
class AdaptedBundle:
    """A bundle that has learned.

    Attributes:
        manifest: Its bundle.toml.
        parts: Its other parts, as `controller.bundles.bundle.write` takes them.
        kept: Share of the rehearsed gestures that are taken for the same ones as before.
        learned: Share of the examples' own windows that are named rightly.
    """

    manifest: bytes
    parts: Mapping[str, bytes]
    kept: float
    learned: float

    def write(self, path: Path) -> None:
        """Write the bundle, complete or not at all.

        Raises:
            BundleError: It would be refused when it is read.
            OSError: It cannot be written.
        """
        bundles.write(path, manifest=self.manifest, parts=self.parts)


def teach(
    data: bytes,
    examples: Sequence[Example],
    *,
    command: str | Sequence[Mapping[str, Any]] | None = None,
    note: str = "",
) -> AdaptedBundle:
    """Return a bundle that has learned from examples.

    Args:
        data: The bundle as a file.
        examples: Of one gesture or several, old or new; a user's own go into a network of theirs.
        command: Command of a new gesture: a word or rules (docs/mapping.md); None: nothing.
        note: Entry of the card; by default the gestures and numbers of examples.

    Raises:
        AdaptError: There is no touch in an example, or the old gestures would suffer.
        BundleError: The bundle is damaged.
    """
    try:
        loaded, parts = bundles.parse(data), bundles.unpack(data)
        table = bundles.manifest(parts[bundles.MANIFEST])
        known = _rehearsal(loaded, parts)
    except (RehearsalError, BundleError) as error:
        raise BundleError(f"the bundle {error}") from None
    fresh = _checked(loaded, known, examples)
    known = replace(known, taught=(*known.taught, *fresh))
    new = tuple(dict.fromkeys(one.label for one in fresh if one.label not in loaded.labels))
    labels = (*loaded.labels, *new)
    everybodys = any(one.user == EVERYBODY for one in fresh)
    asked = {one.user for one in fresh} - {EVERYBODY}
    lesson = _Lesson(loaded, known, labels)
    content = bundles.content(parts)
    base, answers = dict(known.base), dict[str, NDArray[np.float32]]()
    questions = np.concatenate([loaded.golden.windows, *_golden(fresh, loaded.window)])
    heads = list(dict.fromkeys((*loaded.users.heads, *sorted(asked))))
    shares = []
    for user in (EVERYBODY, *heads):
        part = GESTURE if user == EVERYBODY else users_table.head_part(user)
        source = part if part in parts else GESTURE  # a user's first network begins as everybody's
        model = parts[source]
        if everybodys or user in asked:
            model, base[part], share = lesson.learn(model, known.base.get(source), user)
            shares.append(share)
        content[part] = model
        answers[user] = _ask(model, questions)
    table["labels"] = list(labels)
    if command is not None:
        for label in new:
            table["mapping"][label] = command if isinstance(command, str) else [*command]
    _enrol(table, heads, labels)
    table["card"]["added"] = [*table["card"].get("added", []), note or _told(fresh)]
    own = {user: answers[user] for user in heads}
    golden = replace(loaded.golden, windows=questions, probabilities=answers[EVERYBODY], heads=own)
    if heads:
        people = _people(content, len(table["users"]["names"]), questions)
        golden = replace(golden, people=people)
        content.setdefault(users_table.NETWORK, b"")
    content[bundles.GOLDEN] = golden.pack()
    content[rehearsal.PART] = replace(known, base=base).pack()
    return AdaptedBundle(
        tomli_w.dumps(table).encode(),
        content,
        min(kept for kept, _ in shares),
        min(learned for _, learned in shares),
    )


@dataclass(frozen=True)
class _Lesson:
    """What all networks of a bundle learn from.

    Attributes:
        bundle: As it was.
        known: What is rehearsed, and every example.
        labels: The classes from now on.
    """

    bundle: Bundle
    known: Rehearsal
    labels: tuple[str, ...]

    def learn(
        self, model: bytes, base: tuple[int, int] | None, user: str
    ) -> tuple[bytes, tuple[int, int], tuple[float, float]]:
        """Return a network that has learned, its base, and the shares kept and learned."""
        try:
            split = head.take_apart(model, base)
        except FormError as error:
            raise AdaptError(f"the gesture network {error}") from None
        rng = np.random.default_rng(_SEED)
        old, touch = self.known.windows(self.bundle.window, REHEARSED, rng)
        if not len(old):
            raise AdaptError("this bundle has nothing to rehearse; install one that has")
        own = [one for one in self.known.taught if one.user in (EVERYBODY, user)]
        by_label = {one.label: [o for o in own if o.label == one.label] for one in own}
        fresh = [self._windows(one, alike, rng) for alike in by_label.values() for one in alike]
        windows, inside, kinds, weights = map(np.concatenate, zip(*fresh, strict=True))
        embedding = split.embed(np.concatenate([old, windows]))
        logits = split.logits(embedding)
        # The target of old windows is the network's own answer, with its confidence.
        target = [_probabilities(logits[: len(old)], len(self.labels))]
        target.append(np.eye(len(self.labels), dtype=np.float32)[kinds])
        weight = np.concatenate([np.full(len(old), 1.0 / len(old)), weights])
        units = fit_head.fit(
            fit_head.TrainingSet(embedding, logits, np.concatenate(target), weight)
        )
        after = units.answers(embedding)
        after[:, : split.classes] += logits
        names = (_names(answers[: len(old)], touch) for answers in (logits, after))
        kept = _share(np.equal(*names))
        if kept < LEAST_KEPT:
            raise AdaptError(
                f"the other gestures would suffer: {kept:.0%} of those that are rehearsed would be "
                "taken for what they are; give other examples, or a gesture that is less like them"
            )
        learned = _share((after[len(old) :].argmax(axis=1) == kinds)[inside])
        return split.widened(units), (split.hidden, split.classes), (kept, learned)

    def _windows(
        self, one: Example, alike: Sequence[Example], rng: np.random.Generator
    ) -> _ExampleWindows:
        """Return the windows of an example; `alike` are all examples of its label."""
        copies = max(1, COPIES // len(alike))
        windows, telling = vary(one, self.bundle.window, copies, rng)
        inside = telling >= 0.0
        kind = np.where(inside, self.labels.index(one.label), 0)
        each = np.where(inside, telling / max(1.0, float(telling[inside].sum())),
                        AROUND / max(1.0, float((~inside).sum())))  # fmt: skip
        return windows, inside, kind, weight_of(one) * each / len(alike)


def weight_of(example: Example) -> float:
    """Return what an example weighs if it is the only one, all that is rehearsed being 1."""
    return SHARE / (1.0 + example.noise() / NOISY)


def _rehearsal(loaded: Bundle, parts: Mapping[str, bytes]) -> Rehearsal:
    if rehearsal.PART not in parts:
        return rehearsal.of_golden(loaded)
    grid = loaded.rows, loaded.columns
    return rehearsal.read(parts[rehearsal.PART], grid, len(loaded.labels))


def _checked(loaded: Bundle, known: Rehearsal, examples: Sequence[Example]) -> tuple[Example, ...]:
    """Return the examples with their touches found, as they are kept."""
    if not examples:
        raise AdaptError("there are no examples; give one at least")
    if len(known.taught) + len(examples) > MOST_EXAMPLES:
        raise AdaptError(
            f"this bundle was taught {len(known.taught)} examples already, and keeps at most "
            f"{MOST_EXAMPLES}; train one from recordings instead (docs/training.md)"
        )
    fresh = []
    for number, one in enumerate(examples, 1):
        if one.images.shape[1:] != (loaded.rows, loaded.columns) or len(one.images) < 2:
            raise AdaptError(
                f"example {number} has images {one.images.shape}; expected are some of "
                f"{loaded.rows}×{loaded.columns} taxels"
            )
        if one.label == NULL_LABEL:
            found: Example | None = replace(one, span=(0.0, float(len(one.images))))
        else:
            found = one.found(loaded.rate_hz)
        if found is None:
            raise AdaptError(f"example {number} of {one.label} shows no touch; make it again")
        kept = rehearsal.from_bytes(rehearsal.to_bytes(found.images))
        # A gesture that is new is everybody's: all networks of a bundle have the same classes.
        user = one.user if one.label in loaded.labels else EVERYBODY
        fresh.append(replace(found, images=kept, user=user))
    return tuple(fresh)


def _enrol(table: dict[str, Any], heads: Sequence[str], labels: Sequence[str]) -> None:
    """Add users with networks of their own to the manifest."""
    if not heads:
        return
    people = table.setdefault("users", {
        "names": [], "gestures": list(labels[1:])
    })  # fmt: skip
    people["names"] += [name for name in heads if name not in people["names"]]
    people["heads"] = list(heads)


def _people(
    content: Mapping[str, bytes], names: int, questions: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return the user network's answers; it must have an output for each user with a network."""
    model = content.get(users_table.NETWORK, b"")
    if not model:
        return np.zeros((0, 1 + names), dtype=np.float32)
    told = _ask(model, questions)
    if told.shape[1] != 1 + names:
        raise AdaptError(
            "this bundle identifies its users by their touch, and does not know this one; use a "
            "name that it knows, or enrol them: models train --task user (docs/users.md)"
        )
    return told


def _golden(fresh: Sequence[Example], window: int) -> list[NDArray[np.float32]]:
    """Return some windows of each example's touch."""
    found = []
    rng = np.random.default_rng(0)
    for one in fresh:
        made, inside = vary(one, window, 1, rng)
        found.append(made[inside >= 0.0][-GOLDEN_EACH:])
    return found


def _ask(model: bytes, questions: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a network's answers, (n, outputs), to (n, window, rows, columns)."""
    run = engines.open_network(engines.standard(), model, onnx_reader.read(model))
    return run(questions)


def _names(logits: NDArray[np.float32], touch: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return what the mean probability over each touch names, null aside; -1 is no touch."""
    inside = touch >= 0
    total = np.zeros((int(touch.max(initial=-1)) + 1, logits.shape[1] - 1))
    np.add.at(total, touch[inside], _probabilities(logits[inside], logits.shape[1])[:, 1:])
    return np.asarray(1 + total.argmax(axis=1))


def _probabilities(logits: NDArray[np.float32], classes: int) -> NDArray[np.float32]:
    """Return the softmax of logits, (n, classes); classes that they do not know have 0."""
    power = np.exp(logits - logits.max(axis=1, keepdims=True))
    told = np.zeros((len(logits), classes), dtype=np.float32)
    told[:, : logits.shape[1]] = power / power.sum(axis=1, keepdims=True)
    return told


def _share(right: NDArray[np.bool_]) -> float:
    return float(right.mean()) if len(right) else 1.0


def _told(fresh: Sequence[Example]) -> str:
    """Return what was taught, for the card."""
    words = []
    for label, user in dict.fromkeys((one.label, one.user) for one in fresh):
        count = sum((one.label, one.user) == (label, user) for one in fresh)
        whose = f" of {user}" if user else ""
        words.append(f"{label}{whose} from {console.count(count, 'example')}")
    return ", ".join(words)
