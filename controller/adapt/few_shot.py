"""Few-shot learning: fit rows of a bundle's head to examples.

Every change begins with the head as it was trained and with all examples that the bundle keeps, so
the result depends neither on the order of lessons nor on what was forgotten since.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Final

import numpy as np
import tomli_w
from numpy.typing import NDArray

from controller.adapt import lessons
from controller.adapt.examples import Example, varied, vary
from controller.adapt.fit import TrainingSet, fit
from controller.adapt.lessons import Lessons, Rehearsal
from controller.adapt.own_frames import OwnFrames
from controller.bundles import container
from controller.bundles.head import EVERYBODY, Head, Matrix, softmax
from controller.bundles.inference import onnxruntime_engine
from controller.bundles.inference.onnxruntime_engine import EngineError, Network
from controller.recognition.debounce import DebounceSettings, Probabilities
from controller.recognition.debounced_stream import patient
from controller.recognition.images.lying import LyingContact
from controller.shared import errors
from controller.shared.aliases import Windows
from controller.shared.cues import NULL_LABEL
from controller.shared.errors import TroubleError
from controller.shared.notices import notice

MOST_EXAMPLES: Final = 200  # in a bundle, all lessons together
COPIES: Final = 240  # variations of a label's examples together
UNSEEN: Final = 8  # variations of each new example that tell which older gestures fire early
SHARE: Final = 0.185  # weight of a noiseless label that was trained, relative to all rehearsal data
NEW_SHARE: Final = 0.27  # and of a new one
NOISY: Final = 0.2  # noise that halves this weight at 10 Hz, z: it makes gestures more alike
AROUND: Final = 1.0  # weight of the windows around a touch, relative to those within
LEAST_KEPT: Final = 0.9  # least share of what was rehearsed whose class must not change
WELL_KEPT: Final = 0.97  # share of the teacher's other windows with which a lesson is content;
SHARES: Final = (1.0, 0.5, 0.25)  # else a new gesture weighs less
CORRECTED: Final = "corrected in play: "  # begins the note of a correction
_SEED: Final = 0  # the same examples give the same bundle
_EMBEDDED: Final = 64  # windows that are embedded at once
_PREPARED, _READY = 0.1, 0.5  # progress when windows are cut, and when they are embedded

Stretch = tuple[str, Windows]  # its label, and windows (n, window, rows, columns)
Progress = Callable[[float], None]  # takes the share that is done, 0 to 1


class AdaptError(TroubleError, ValueError):
    """The examples cannot be learned; the message is one sentence with the reason."""


@dataclass(frozen=True)
class AdaptedBundle:
    """A changed bundle."""

    manifest: bytes  # its bundle.toml
    parts: Mapping[str, bytes]  # its other parts, for `controller.bundles.bundle.write`
    kept: float = 1.0  # share of the rehearsed gestures whose class is unchanged
    # when its gestures fire; older ones may wait for a taught one
    debounce: DebounceSettings = field(default_factory=DebounceSettings)


def teach(
    data: bytes,
    examples: Sequence[Example],
    *,
    command: str | Sequence[Mapping[str, Any]] | None = None,
    note: str = "",
    again: bool = False,
    own: Sequence[Stretch] = (),
    progress: Progress = lambda share: None,
) -> AdaptedBundle:
    """Return a bundle extended by examples.

    Args:
        data: Content of the bundle's file.
        examples: Of one gesture or several, old or new; those of a user change the user's rows.
        command: Command of a gesture that it was not trained with: a word or rules
            (docs/mapping.md); "": nothing, None: as before.
        note: Entry of the card; by default the gestures and numbers of examples.
        again: Earlier examples of the same gestures and users are replaced; older gestures wait
            for them where they must.
        own: What else is known of those who teach: stretches of other gestures and of null. They
            are rehearsed like windows of the training, and a third of them judges the lesson.
        progress: Called with the share that is done.

    Raises:
        AdaptError: An example holds no touch, or the old gestures would suffer.
        BundleError: The bundle is damaged.
    """
    before = lessons.read(data)
    fresh = _checked(before, examples)
    for label in {one.label for one in fresh} if again else ():
        before = _waited(before, label)
    replaced = {(one.label, one.user) for one in fresh} if again else set()
    rest = tuple(one for one in before.examples if (one.label, one.user) not in replaced)
    rules = {} if command is None else {one.label: command for one in fresh}
    notes = [note] if note else _described(fresh)
    notes = _notes(before, rest) + notes
    return _relearned(before, (*rest, *fresh), rules, notes, progress, own)


def forget(data: bytes, label: str, progress: Progress = lambda share: None) -> AdaptedBundle:
    """Return a bundle without a taught gesture, as if it had never been taught.

    Raises:
        AdaptError: The gesture was not taught.
        BundleError: The bundle is damaged.
    """
    if label not in lessons.read(data).taught:
        raise AdaptError(notice("not_taught", label))
    return without(data, label, progress)


def without(data: bytes, label: str, progress: Progress = lambda share: None) -> AdaptedBundle:
    """Return a bundle without the examples of a gesture; BundleError if it is damaged."""
    before = lessons.read(data)
    rest = tuple(one for one in before.examples if one.label != label)
    return _relearned(_waited(before, label), rest, {}, _notes(before, rest), progress)


def waiting(
    data: bytes, label: str, *, wait: bool, progress: Progress = lambda share: None
) -> AdaptedBundle:
    """Return a bundle in which older gestures wait for a taught one, or never do.

    Raises:
        AdaptError: The gesture was not taught.
        BundleError: The bundle is damaged.
    """
    before = lessons.read(data)
    if label not in before.taught:
        raise AdaptError(notice("not_taught", label))
    before = _waited(before, label, wait=wait)
    return _relearned(before, before.examples, {}, _notes(before, before.examples), progress)


def _waited(before: Lessons, label: str, *, wait: bool = True) -> Lessons:
    """Return lessons in which older gestures may wait for a gesture, or never do."""
    eager = [one for one in before.debounce.eager if one != label] + [label] * (not wait)
    return replace(before, debounce=replace(before.debounce, eager=tuple(eager)))


# --- a lesson -------------------------------------------------------------------------------------


def _relearned(
    before: Lessons,
    examples: Sequence[Example],
    rules: Mapping[str, Any],
    notes: Sequence[str],
    progress: Progress,
    stretches: Sequence[Stretch] = (),
) -> AdaptedBundle:
    """Return the bundle that examples make of the head as it was trained."""
    table = _manifest(before, examples, rules, notes)
    content = container.content(before.parts)
    content.pop(container.TAUGHT, None)
    if not examples:
        return AdaptedBundle(_text(table), content)
    lesson = _Lesson.of(before, table, stretches)
    fitted = {
        user: lesson.fit([one for one in examples if one.user in (EVERYBODY, user)], progress)
        for user in sorted({one.user for one in examples})
    }
    settings = before.debounce
    if new := [o for o in examples if o.label not in before.trained and o.user == EVERYBODY]:
        settings = lesson.patient(settings, fitted[EVERYBODY][0], new)
    table["debounce"] = asdict(settings)
    rows = {user: own for user, (own, _) in fitted.items()}
    content[container.TAUGHT] = lessons.pack_taught(examples, lesson.own, before.debounce, rows)
    kept = min(share for _, share in fitted.values())
    return AdaptedBundle(_text(table), content, kept, settings)


def _manifest(
    before: Lessons, examples: Sequence[Example], rules: Mapping[str, Any], notes: Sequence[str]
) -> dict[str, Any]:
    """Return the manifest with the labels, users and notes of examples, and rules of new labels."""
    table = {**before.table, "card": {**before.table["card"]}}
    labels = list(dict.fromkeys((*before.trained, *(one.label for one in examples))))
    own = {label: rule for label, rule in rules.items() if label not in before.trained}
    mapping = {**table["mapping"], **own}
    table["mapping"] = {k: rule for k, rule in mapping.items() if k in labels and rule != ""}
    table["labels"], table["debounce"] = labels, asdict(before.debounce)
    share, rate_hz = table["preprocess"].get("beside", 0.0), table["rate_hz"]
    for label in set(labels) - set(before.trained):
        taught = [_of_several(one, share, rate_hz) for one in examples if one.label == label]
        if 2 * sum(taught) > len(taught):
            table["preprocess"] = {**table["preprocess"], "beside": 0.0}
    table["contact"] = {k: v for k, v in table.get("contact", {}).items() if k != "taught"}
    if anew := [label for label in before.trained if any(o.label == label for o in examples)]:
        table["contact"]["taught"] = anew
    table["card"].pop("added", None)
    if notes:
        table["card"]["added"] = list(notes)
    learners = sorted({one.user for one in examples} - {EVERYBODY})
    if learners or "users" in table:
        users = {"names": [], "gestures": labels[1:], "mapping": {}, **table.get("users", {})}
        users["names"] = list(dict.fromkeys((*users["names"], *learners)))
        users["gestures"] = [label for label in users["gestures"] if label in labels]
        for name, commands in users["mapping"].items():
            users["mapping"][name] = {k: rule for k, rule in commands.items() if k in labels}
        table["users"] = users
    return table


@dataclass(frozen=True, slots=True, eq=False)
class _Lesson:
    """Fits rows to examples and to embeddings of the training."""

    embedding: Network
    head: Head  # as it was trained
    known: Rehearsal
    own: OwnFrames
    labels: tuple[str, ...]  # old and new
    window: int
    rate_hz: float

    @classmethod
    def of(
        cls, before: Lessons, table: Mapping[str, Any], stretches: Sequence[Stretch]
    ) -> "_Lesson":
        """Return the lesson of a bundle and its new manifest; AdaptError if it cannot learn."""
        if before.rehearsal is None:
            raise AdaptError(notice("no_rehearsal"))
        window, rate_hz = table["window"], table["rate_hz"]
        model, width = before.parts[container.EMBEDDING], before.head.hidden.shape[1]
        try:
            embedding = onnxruntime_engine.checked(model, (window, *before.grid), width)
        except EngineError as error:
            raise AdaptError(notice("the_network", error)) from None
        labels = tuple(table["labels"])
        own = before.own
        for label, windows in stretches:
            outputs = _embed(embedding, windows)
            touch = np.zeros(len(windows), dtype=np.int32)
            own = own.joined(OwnFrames(outputs, touch, np.full(len(windows), label, "U40")))
        own = own.thinned()
        return cls(embedding, before.head, before.rehearsal, own, labels, window, rate_hz)

    def fit(self, examples: Sequence[Example], progress: Progress) -> tuple[Head, float]:
        """Return rows fitted to examples, and the share of the rehearsed gestures that stays.

        AdaptError if the old gestures would suffer.
        """
        rng = np.random.default_rng(_SEED)
        alike = {one.label: sum(o.label == one.label for o in examples) for one in examples}
        cut = [self._windows(one, alike[one.label], rng) for one in examples]
        windows, kinds, weights = map(np.concatenate, zip(*cut, strict=True))
        progress(_PREPARED)
        learned, judging = self.own.split(self.labels)
        own = self.own.embedding[learned.windows]
        embedding = np.concatenate([self.known.embedding, _embed(self.embedding, windows), own])
        progress(_READY)
        logits, old = self.head.logits(embedding), len(self.known.embedding)
        trained = logits.shape[1]
        # The target of old windows is the head's own output, with its confidence.
        target = np.zeros((len(embedding), len(self.labels)), dtype=np.float32)
        target[:old, :trained] = softmax(logits[:old])
        target[old + np.arange(len(own) + len(kinds)), np.append(kinds, learned.kinds)] = 1.0
        weight = np.concatenate([np.full(old, 1.0 / old), weights, learned.weights()])
        new = np.flatnonzero(np.append(np.full(old, 0), kinds) >= trained)
        if len(own) and len(new):  # a new gesture then weighs as much as an old one
            usual = float((weight @ target - weight[new] @ target[new])[1:trained].mean())
            weight[new] *= max(1.0, usual / NEW_SHARE)
        for fewer in SHARES if len(judging.windows) and len(new) else SHARES[:1]:
            lighter = weight.copy()
            lighter[new] *= fewer
            data = TrainingSet(embedding, logits, target, lighter)
            rows = fit(data, lambda share: progress(_READY + (1.0 - _READY) * share))
            head = self.head.extended(rows)
            after = head.logits(embedding)
            before, now = (_classes(values[:old], self.known.touch) for values in (logits, after))
            kept = float((before == now).mean()) if len(now) else 1.0
            kept = min(kept, judging.kept(self.own.embedding, self.head, head))
            if kept >= WELL_KEPT:
                break
        if kept < LEAST_KEPT:
            raise AdaptError(notice("suffer", kept))
        return rows, kept

    def patient(
        self, settings: DebounceSettings, rows: Head, examples: Sequence[Example]
    ) -> DebounceSettings:
        """Return debounce settings with which older gestures wait for those of examples."""
        head = self.head.extended(rows)
        for label in dict.fromkeys(one.label for one in examples):
            own = [one for one in examples if one.label == label]
            idle = float(np.mean([one.noise() for one in own])) / math.sqrt(2.0)  # of two frames
            streams = self._streams(head, own)
            settings = patient(settings, self.labels, label, streams, self.rate_hz, idle)
        return settings

    def _streams(self, head: Head, examples: Sequence[Example]) -> list[Probabilities]:
        """Return probabilities, (frames, classes), of each example and of its variations.

        What was learned is answered better than what will come: the variations are new to the head.
        """
        rng = np.random.default_rng(_SEED + 1)  # other variations than those learned
        seen = [o.images for one in examples for o in (one, *varied(one, UNSEEN, rng))]
        cut = []
        for images in seen:
            whole = np.concatenate([np.repeat(images[:1], self.window - 1, axis=0), images])
            frames = np.arange(len(images))[:, None] + np.arange(self.window)
            cut.append(whole[frames].astype(np.float32))
        answers = head.probabilities(_embed(self.embedding, np.concatenate(cut)))
        return np.split(answers, np.cumsum([len(images) for images in seen])[:-1])

    def _windows(
        self, one: Example, alike: int, rng: np.random.Generator
    ) -> tuple[Windows, NDArray[np.int64], NDArray[np.float64]]:
        """Return windows of an example, their classes and their weights, (n,).

        `alike` is the number of examples of its label.
        """
        windows, telling = vary(one, self.window, max(1, COPIES // alike), rng)
        inside = telling >= 0.0
        kind = np.where(inside, self.labels.index(one.label), 0)
        within = telling / max(1.0, float(telling[inside].sum()))
        each = np.where(inside, within, AROUND / max(1.0, float((~inside).sum())))
        new = self.labels.index(one.label) >= len(self.head.out)
        return windows, kind, weight_of(one, self.rate_hz, new=new) * each / alike


def _embed(network: Network, windows: Windows) -> Matrix:
    """Return the embeddings of windows, (n, width)."""
    parts = range(0, len(windows), _EMBEDDED)
    return np.concatenate([network(windows[at : at + _EMBEDDED]) for at in parts])


def weight_of(example: Example, rate_hz: float = 10.0, *, new: bool = False) -> float:
    """Return the weight of a label's only example, relative to all rehearsal data.

    The noise that halves it grows with the root of the rate, as that of a frame does. A `new` label
    was not in the training.
    """
    share = NEW_SHARE if new else SHARE
    return share / (1.0 + example.noise() / (NOISY * math.sqrt(rate_hz / 10.0)))


def _checked(before: Lessons, examples: Sequence[Example]) -> tuple[Example, ...]:
    """Return the examples with the spans of their touches, quantised as they are stored."""
    table = before.table
    if not examples:
        raise AdaptError(notice("none_given"))
    if len(before.examples) + len(examples) > MOST_EXAMPLES:
        raise AdaptError(notice("bundle_full", len(before.examples), MOST_EXAMPLES))
    names = table.get("users", {}).get("names", ())
    fresh = []
    for number, one in enumerate(examples, 1):
        if one.images.shape[1:] != before.grid or len(one.images) < 2:
            grid = "{}×{}".format(*before.grid)
            raise AdaptError(notice("shapeless", number, one.images.shape, grid))
        if one.label == NULL_LABEL:
            found: Example | None = replace(one, span=(0.0, float(len(one.images))))
        else:
            found = one.found(table["rate_hz"])
        if found is None:
            raise AdaptError(notice("no_touch", number, notice("gesture", one.label)))
        # A gesture that the bundle was not trained with is for all users.
        user = one.user if one.label in table["labels"] else EVERYBODY
        if user != EVERYBODY and before.parts.get(container.USER) and user not in names:
            raise AdaptError(notice("no_user"))
        fresh.append(replace(found, user=user))
    return lessons.unpack(lessons.pack(fresh, before.grid))


def _of_several(example: Example, share: float, rate_hz: float) -> bool:
    """Return whether contacts of an example begin beside others of it: it is seen as a whole."""
    rows, columns = example.images.shape[1:]
    stage = LyingContact(rows, columns, rate_hz, share)
    return any(stage.step(image, example.noise() / math.sqrt(2.0)) for image in example.images)


def _classes(logits: Matrix, touch: NDArray[np.int32]) -> NDArray[np.int64]:
    """Return the class, null aside, of the highest mean probability over each touch, (touches,).

    `logits` is (n, classes), `touch` the number of each window's touch, -1 without one, (n,).
    """
    inside = touch >= 0
    total = np.zeros((int(touch.max(initial=-1)) + 1, logits.shape[1] - 1))
    np.add.at(total, touch[inside], softmax(logits[inside])[:, 1:])
    return np.asarray(1 + total.argmax(axis=1))


def _described(fresh: Sequence[Example]) -> list[str]:
    """Return the labels, users and numbers of examples, for the card."""
    whose = Counter((one.label, one.user) for one in fresh)
    return [
        f"{label}{f' of {user}' if user else ''} from {errors.count(number, 'example')}"
        for (label, user), number in whose.items()
    ]


def _notes(before: Lessons, rest: Sequence[Example]) -> list[str]:
    """Return the notes of the card on the lessons whose examples remain."""
    kept = {"nothing" if one.label == NULL_LABEL else one.label for one in rest}
    notes = before.table["card"].get("added", [])
    return [n for n in map(str, notes) if n.removeprefix(CORRECTED).partition(" ")[0] in kept]


def _text(table: dict[str, Any]) -> bytes:
    return tomli_w.dumps(table).encode()
