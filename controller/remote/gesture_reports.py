"""Messages that describe the bundle in use: Vocabulary and those that follow it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from controller.adapt import lessons
from controller.adapt.lessons import Lessons
from controller.bundles import bundle as bundles
from controller.bundles import vocabulary
from controller.bundles.bundle import Bundle
from controller.bundles.container import BundleError
from controller.bundles.deploy.store import BundleStore
from controller.bundles.head import EVERYBODY
from controller.recognition.mapping import NONE, Mapping, Rule
from controller.remote.examples import ExampleStore, firmest, image_bytes
from controller.remote.worker import Worker, failed
from controller.runtime.assemble import Parts, bundle_path
from controller.runtime.device import Device
from controller.runtime.loop import Handler
from controller.shared.protocol.codec import ProtocolError, fitted
from controller.shared.protocol.messages import Message
from controller.shared.protocol.packets import encode
from controller.shared.protocol.teaching import (
    MOST_RULES,
    CommandRule,
    Describe,
    GestureInfo,
    TouchStrength,
    UserInfo,
    Vocabulary,
)

_TEXT: Final = 64  # bytes of names
_FOLDER: Final = 255
Description = Vocabulary | GestureInfo | UserInfo | TouchStrength

_SHIPPED: Final = (bundles.default_path(), bundles.default_path(bundles.SLOW_HZ))


class Describer(Handler):
    """Handler of Describe, and of all that the worker has done."""

    def __init__(
        self,
        current: Callable[[], Parts],
        worker: Worker,
        examples: ExampleStore,
        folder: Path,
        objection: str,
    ) -> None:
        """Describe the current parts, and the pending examples unless there is an objection."""
        self._current, self._worker, self._examples = current, worker, examples
        self._folder, self._objection = folder, objection

    def describe(self, parts: Parts) -> tuple[Message, ...]:
        """Return the description of the parts; BundleError, OSError."""
        path = bundle_path(parts.options)
        return reports(path, parts.mapping, self._folder, self._objection)

    def take(self, message: Message, device: Device) -> Sequence[Message] | None:
        """Begin a description."""
        return self._worker.begin(self._described) if isinstance(message, Describe) else None

    def poll(self, device: Device) -> Sequence[Message]:
        """Return the worker's messages; a description of former gestures is made again."""
        messages = self._worker.poll()
        labels = self._current().bundle.labels
        if all(not isinstance(m, Vocabulary) or m.labels == labels for m in messages):
            return messages
        kept = [m for m in messages if not isinstance(m, Description)]
        return kept + self._worker.begin(self._described)

    def _described(self) -> Iterable[Message]:
        try:
            described = self.describe(self._current())
        except (BundleError, OSError) as error:
            return [failed(str(error))]
        if self._objection:
            return described
        pending = sorted(self._examples.pending.values(), key=lambda one: one.number)
        return [*described, *(self._examples.report(one) for one in pending)]


def reports(path: Path, mapping: Mapping, folder: Path, objection: str) -> tuple[Description, ...]:
    """Return the description of the bundle in a file with the mapping in use.

    `folder` is that of the player's data, `objection` the reason that nothing can be changed.
    BundleError, OSError: The bundle cannot be read.
    """
    data = path.read_bytes()
    loaded, known = bundles.parse(data), lessons.read(data)
    taught = known.taught
    store = BundleStore()
    record = store.record()
    installed = path == store.path(record.current)
    head = Vocabulary(
        loaded.labels,
        loaded.users.commands(mapping),
        "" if path in _SHIPPED else fitted(path.stem, _TEXT),
        installed and record.before is not None,
        len(taught),
        "" if objection else fitted(str(folder), _FOLDER),
        objection,
    )
    try:
        encode(head, session=0, sequence=0, t_ms=0)
    except ProtocolError:  # so many labels that they fill the packet
        head = replace(head, folder="")
    said = {one.label: one.say for one in vocabulary.of(loaded.labels).entries}
    infos = (
        GestureInfo(
            label,
            fitted(said[label], _TEXT),
            label in taught,
            sum(one.label == label for one in known.examples),
            _image(known, label),
            _rules(mapping, label),
        )
        for label in loaded.labels[1:]
    )
    strengths = {EVERYBODY: loaded.strength, **loaded.users.strengths}
    users = (_user(loaded, name) for name in loaded.users.names)
    return head, *infos, *users, *(TouchStrength(*pair) for pair in strengths.items())


def _user(loaded: Bundle, name: str) -> UserInfo:
    """Return a user with the commands of the own mapping, as many as fit."""
    rules = loaded.users.mapping(name, Mapping()).rules
    pairs = [(label, command) for label, own in rules.items() for command in _commands(own)]
    while True:
        info = UserInfo(name, *(zip(*pairs, strict=True) if pairs else ((), ())))
        try:
            encode(info, session=0, sequence=0, t_ms=0)
        except ProtocolError:
            pairs.pop()
        else:
            return info


def _commands(rules: Sequence[Rule]) -> list[str]:
    return list(dict.fromkeys(rule.command for rule in rules))


def _rules(mapping: Mapping, label: str) -> tuple[CommandRule, ...]:
    """Return the rules of a gesture; () if it never has a command."""
    rules = mapping.rules.get(label, ())
    if all(rule.command == NONE for rule in rules):
        return ()
    return tuple(
        CommandRule(rule.command, rule.left_of, rule.right_of, rule.below, rule.above)
        for rule in rules[:MOST_RULES]
    )


def _image(known: Lessons, label: str) -> bytes:
    """Return the mean image of a gesture's touches at their firmest; b"" if there are none."""
    firm = [firmest(one) for one in known.examples if one.label == label]
    if known.rehearsal is not None and label in known.trained:
        firm.append(lessons.from_bytes(known.rehearsal.firmest)[known.trained.index(label)])
    return image_bytes(np.mean(firm, axis=0)) if firm else b""
