"""Few-shot learning: extend a bundle's gesture networks by examples."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import tomli_w
from numpy.typing import NDArray

from controller import errors
from controller.adapt import head, patience, rehearsal
from controller.adapt.examples import EVERYBODY, NULL_LABEL, Example, varied, vary
from controller.adapt.head import FormError
from controller.adapt.rehearsal import Origin, Rehearsal, RehearsalError
from controller.bundles import bundle as bundles
from controller.bundles import users_table
from controller.bundles.bundle import Bundle, BundleError
from controller.bundles.inference import onnxruntime_engine
from controller.errors import TroubleError
from controller.recognition.debounce import DebounceSettings

GESTURE: Final = bundles.CONTENT[0]
MOST_EXAMPLES: Final = 200  # in a bundle, all lessons together
COPIES: Final = 240  # variations of a label's examples together
UNSEEN: Final = 8  # variations of each new example that tell which older gestures fire early
REHEARSED: Final = 3  # variations of the rehearsal data
SHARE: Final = 0.185  # weight of a label's noiseless examples, relative to all rehearsal data
NOISY: Final = 0.03  # noise that halves this weight at 10 Hz, z: it makes gestures more alike
AROUND: Final = 1.0  # weight of the windows around a touch, relative to those within
LEAST_KEPT: Final = 0.9  # least share of rehearsed gestures whose class must not change
_SEED: Final = 0  # the same examples give the same bundle
GOLDEN_EACH: Final = 4  # windows of an example that become golden vectors
EMBEDDED: Final = 0.5  # of the whole progress, when all windows are embedded

Progress = Callable[[float], None]  # takes the share that is done, 0 to 1


class AdaptError(TroubleError, ValueError):
    """The examples cannot be learned; the message is one sentence with the reason."""


@dataclass(frozen=True)
class AdaptedBundle:
    """An extended bundle."""

    manifest: bytes  # its bundle.toml
    parts: Mapping[str, bytes]  # its other parts, for `controller.bundles.bundle.write`
    kept: float  # share of the rehearsed gestures whose class is unchanged
    # when its gestures fire; older ones may wait for a taught one
    debounce: DebounceSettings = field(default_factory=DebounceSettings)
    recognised: Mapping[str, float] = field(default_factory=dict)  # the same by label

    def write(self, path: Path) -> None:
        """Write the bundle atomically; BundleError if it could not be read, OSError."""
        bundles.write(path, manifest=self.manifest, parts=self.parts)


def teach(
    data: bytes,
    examples: Sequence[Example],
    *,
    command: str | Sequence[Mapping[str, Any]] | None = None,
    note: str = "",
    progress: Progress = lambda share: None,
) -> AdaptedBundle:
    """Return a bundle extended by examples.

    Args:
        data: Content of the bundle's file.
        examples: Of one gesture or several, old or new; those of a user extend the user's network.
        command: Command of a new gesture: a word or rules (docs/mapping.md); None: nothing.
        note: Entry of the card; by default the gestures and numbers of examples.
        progress: Called with the share that is done.

    Raises:
        AdaptError: An example holds no touch, or the old gestures would suffer.
        BundleError: The bundle is damaged.
    """
    loaded, parts, known = opened(data)
    table = bundles.manifest(parts[bundles.MANIFEST])
    if not known.taught:
        origin = Origin(parts[bundles.MANIFEST], len(loaded.golden.windows))
        known = replace(known, origin=origin)
    fresh = _checked(loaded, known, examples)
    known = replace(known, taught=(*known.taught, *fresh))
    new = tuple(dict.fromkeys(one.label for one in fresh if one.label not in loaded.labels))
    labels = (*loaded.labels, *new)
    for_all = any(one.user == EVERYBODY for one in fresh)
    learners = {one.user for one in fresh} - {EVERYBODY}
    training = _Training(loaded, known, labels)
    content = bundles.content(parts)
    base, outputs = dict(known.base), dict[str, NDArray[np.float32]]()
    inputs = np.concatenate([loaded.golden.windows, *_golden(fresh, loaded.window)])
    heads = list(dict.fromkeys((*loaded.users.heads, *sorted(learners))))
    shares: list[float] = []
    recognised: dict[str, float] = {}
    for user in (EVERYBODY, *heads):
        part = GESTURE if user == EVERYBODY else users_table.head_part(user)
        source = part if part in parts else GESTURE  # a user's first network starts as the common
        model = parts[source]
        if for_all or user in learners:
            extended = training.extend(model, known.base.get(source), user, progress)
            model, base[part] = extended.model, extended.base
            shares.append(extended.kept)
            recognised = recognised or extended.recognised
        content[part] = model
        outputs[user] = run_network(model, inputs)
    streams = {
        label: _streams(content[GESTURE], [o for o in fresh if o.label == label], loaded.window)
        for label in new
    }
    idle = float(np.mean([one.noise() for one in fresh])) / math.sqrt(2.0)  # it is of two frames
    debounce = loaded.debounce
    for label, seen in streams.items():
        debounce = patience.patient(debounce, labels, {label: seen}, loaded.rate_hz, idle)
    table["debounce"] = asdict(debounce)
    table["labels"] = list(labels)
    if command is not None:
        for label in new:
            table["mapping"][label] = command if isinstance(command, str) else [*command]
    _enrol(table, heads, labels)
    table["card"]["added"] = [*table["card"].get("added", []), note or _described(fresh)]
    own = {user: outputs[user] for user in heads}
    golden = replace(loaded.golden, windows=inputs, probabilities=outputs[EVERYBODY], heads=own)
    if heads:
        people = _people(content, len(table["users"]["names"]), inputs)
        golden = replace(golden, people=people)
        content.setdefault(users_table.NETWORK, b"")
    content[bundles.GOLDEN] = golden.pack()
    content[rehearsal.PART] = replace(known, base=base).pack()
    text = tomli_w.dumps(table).encode()
    return AdaptedBundle(text, content, min(shares), debounce, recognised)


class _Extended(NamedTuple):
    """One network, extended."""

    model: bytes
    base: tuple[int, int]  # units and classes when it was trained
    kept: float  # share of the rehearsed gestures whose class is unchanged
    recognised: dict[str, float]  # by label: that of a taught one is of its examples' last windows


@dataclass(frozen=True)
class _Training:
    """Training data of all networks of a bundle."""

    bundle: Bundle  # the bundle before
    known: Rehearsal  # rehearsal data and all examples
    labels: tuple[str, ...]  # old and new classes

    def extend(
        self, model: bytes, base: tuple[int, int] | None, user: str, progress: Progress
    ) -> _Extended:
        """Return an extended network."""
        try:
            split = head.split(model, base)
        except FormError as error:
            raise AdaptError(f"the gesture network {error}") from None
        rng = np.random.default_rng(_SEED)
        old, touch = self.known.windows(self.bundle.window, REHEARSED, rng)
        if not len(old):
            raise AdaptError("this bundle has nothing to rehearse; install one that has")
        own = [one for one in self.known.taught if one.user in (EVERYBODY, user)]
        by_label = {one.label: [o for o in own if o.label == one.label] for one in own}
        fresh = [self._windows(one, alike, rng) for alike in by_label.values() for one in alike]
        windows, kinds, weights = map(np.concatenate, zip(*fresh, strict=True))
        progress(0.1)
        embedding = split.embed(np.concatenate([old, windows]))
        progress(EMBEDDED)
        logits = split.logits(embedding)
        # The target of old windows is the network's own output, with its confidence.
        target = [_probabilities(logits[: len(old)], len(self.labels))]
        target.append(np.eye(len(self.labels), dtype=np.float32)[kinds])
        weight = np.concatenate([np.full(len(old), 1.0 / len(old)), weights])
        data = head.TrainingSet(embedding, logits, np.concatenate(target), weight)
        units = head.fit(data, lambda share: progress(EMBEDDED + (1.0 - EMBEDDED) * share))
        after = units.answers(embedding)
        after[:, : split.classes] += logits
        before, now = (_classes(values[: len(old)], touch) for values in (logits, after))
        kept = float((before == now).mean()) if len(now) else 1.0
        recognised = {
            self.labels[k]: float((now[before == k] == k).mean()) for k in set(before.tolist())
        }
        for label in by_label:
            k = self.labels.index(label)
            if k >= split.classes:
                own = (kinds == k) & (weights >= 0.99 * weights[kinds == k].max())  # its last part
                recognised[label] = float((after[len(old) :][own].argmax(axis=1) == k).mean())
        if kept < LEAST_KEPT:
            raise AdaptError(
                f"the other gestures would suffer: {kept:.0%} of those that are rehearsed would be "
                "taken for what they are; give other examples, or a gesture that is less like them"
            )
        return _Extended(split.widened(units), (split.hidden, split.classes), kept, recognised)

    def _windows(
        self, one: Example, alike: Sequence[Example], rng: np.random.Generator
    ) -> tuple[NDArray[np.float32], NDArray[np.int64], NDArray[np.float64]]:
        """Return windows, (n, window, rows, columns), their classes and their weights, (n,).

        `alike` holds all examples of its label.
        """
        copies = max(1, COPIES // len(alike))
        windows, telling = vary(one, self.bundle.window, copies, rng)
        inside = telling >= 0.0
        kind = np.where(inside, self.labels.index(one.label), 0)
        each = np.where(inside, telling / max(1.0, float(telling[inside].sum())),
                        AROUND / max(1.0, float((~inside).sum())))  # fmt: skip
        return windows, kind, weight_of(one, self.bundle.rate_hz) * each / len(alike)


def weight_of(example: Example, rate_hz: float = 10.0) -> float:
    """Return the weight of a label's only example, relative to all rehearsal data.

    The noise that halves it grows with the root of the rate, as that of a frame does.
    """
    return SHARE / (1.0 + example.noise() / (NOISY * math.sqrt(rate_hz / 10.0)))


def opened(data: bytes) -> tuple[Bundle, dict[str, bytes], Rehearsal]:
    """Return a bundle's content, its parts and its rehearsal data; BundleError if damaged."""
    try:
        loaded, parts = bundles.parse(data), bundles.unpack(data)
        if rehearsal.PART not in parts:
            return loaded, parts, rehearsal.of_golden(loaded)
        grid = loaded.rows, loaded.columns
        return loaded, parts, rehearsal.read(parts[rehearsal.PART], grid, len(loaded.labels))
    except (RehearsalError, BundleError) as error:
        raise BundleError(f"the bundle {error}") from None


def _checked(loaded: Bundle, known: Rehearsal, examples: Sequence[Example]) -> tuple[Example, ...]:
    """Return the examples with the spans of their touches, quantised as they are stored."""
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
        # A new gesture is for all users: all networks of a bundle have the same classes.
        user = one.user if one.label in loaded.labels else EVERYBODY
        fresh.append(replace(found, images=kept, user=user))
    return tuple(fresh)


def _enrol(table: dict[str, Any], heads: Sequence[str], labels: Sequence[str]) -> None:
    """Add users with networks of their own to the manifest."""
    if not heads:
        return
    section = table.setdefault("users", {"names": [], "gestures": list(labels[1:])})
    section["names"] += [name for name in heads if name not in section["names"]]
    section["heads"] = list(heads)


def _people(
    content: Mapping[str, bytes], names: int, inputs: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return the user network's outputs, (n, 1 + names), or AdaptError if a user has none."""
    model = content.get(users_table.NETWORK, b"")
    if not model:
        return np.zeros((0, 1 + names), dtype=np.float32)
    outputs = run_network(model, inputs)
    if outputs.shape[1] != 1 + names:
        raise AdaptError(
            "this bundle identifies its users by their touch, and does not know this one; use a "
            "name that it knows, or enrol them: models train --task user (docs/users.md)"
        )
    return outputs


def _golden(fresh: Sequence[Example], window: int) -> list[NDArray[np.float32]]:
    """Return some windows of each example's touch, each (n, window, rows, columns)."""
    found = []
    rng = np.random.default_rng(0)
    for one in fresh:
        windows, inside = vary(one, window, 1, rng)
        found.append(windows[inside >= 0.0][-GOLDEN_EACH:])
    return found


def _streams(model: bytes, examples: Sequence[Example], window: int) -> list[NDArray[np.float32]]:
    """Return a network's probabilities for each frame of examples and of their variations.

    Each is (frames, classes). What was learned is answered better than what will come: the
    variations are new to the network.
    """
    rng = np.random.default_rng(_SEED + 1)  # other variations than those learned
    seen = [images for one in examples for images in (one.images, *varied(one, UNSEEN, rng))]
    cut = []
    for images in seen:
        whole = np.concatenate([np.repeat(images[:1], window - 1, axis=0), images])
        cut.append(whole[np.arange(len(images))[:, None] + np.arange(window)].astype(np.float32))
    answers = run_network(model, np.concatenate(cut))
    return np.split(answers, np.cumsum([len(images) for images in seen])[:-1])


def run_network(model: bytes, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a network's outputs, (n, outputs), for (n, window, rows, columns)."""
    return onnxruntime_engine.network(model)(inputs)


def _classes(logits: NDArray[np.float32], touch: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the class, null aside, of the highest mean probability over each touch, (touches,).

    `logits` is (n, classes), `touch` the number of each window's touch, -1 without one, (n,).
    """
    inside = touch >= 0
    total = np.zeros((int(touch.max(initial=-1)) + 1, logits.shape[1] - 1))
    np.add.at(total, touch[inside], _probabilities(logits[inside], logits.shape[1])[:, 1:])
    return np.asarray(1 + total.argmax(axis=1))


def _probabilities(logits: NDArray[np.float32], classes: int) -> NDArray[np.float32]:
    """Return the softmax of logits, (n, classes); further classes have probability 0."""
    power = np.exp(logits - logits.max(axis=1, keepdims=True))
    shares = np.zeros((len(logits), classes), dtype=np.float32)
    shares[:, : logits.shape[1]] = power / power.sum(axis=1, keepdims=True)
    return shares


def _described(fresh: Sequence[Example]) -> str:
    """Return the labels, users and numbers of examples, for the card."""
    words = []
    for label, user in dict.fromkeys((one.label, one.user) for one in fresh):
        count = sum((one.label, one.user) == (label, user) for one in fresh)
        whose = f" of {user}" if user else ""
        words.append(f"{label}{whose} from {errors.count(count, 'example')}")
    return ", ".join(words)
