"""Teaching over the link: examples, changes of the bundle, and what describes it.

`Teacher` takes the requests of `controller.shared.protocol.teaching` on the loop's thread and never
waits: files are written by a `Worker`, and bundles are changed by a `BundleUpdater`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from controller.adapt import AdaptError, commands, few_shot, process
from controller.adapt.examples import TURNS
from controller.adapt.process import Change
from controller.bundles.container import BundleError
from controller.bundles.deploy.store import INCOMING, BundleStore
from controller.remote.examples import ExampleStore, ExampleTaker, untaken
from controller.remote.gesture_reports import reports
from controller.remote.link_check import LinkCheck
from controller.remote.link_recording import LinkRecording
from controller.remote.worker import Worker
from controller.runtime.assemble import bundle_path
from controller.runtime.parts import Parts
from controller.sensors.geometry import SensorError
from controller.shared import files
from controller.shared.errors import count, reason
from controller.shared.protocol.codec import fitted
from controller.shared.protocol.messages import COMMANDS, MAX_SENTENCE, Message
from controller.shared.protocol.teaching import (
    DONE,
    FAILED,
    LEARNING,
    Check,
    DeleteExamples,
    Describe,
    ExampleDrop,
    ExampleEnd,
    ExampleStart,
    Forget,
    GestureInfo,
    InjectFault,
    Learn,
    LearnStatus,
    Recalibrate,
    Record,
    RecordLabel,
    SaveAs,
    SetCommand,
    Undo,
    UserInfo,
    Vocabulary,
)

if TYPE_CHECKING:
    from controller.remote.bundle_updates import BundleUpdater
    from controller.runtime.device import Device

MOST_SAVED: Final = 100  # bundles kept by SaveAs
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,39}")
_COMMAND: Final = re.compile(r"[a-z][a-z0-9_]{0,39}")
_BUSY: Final = "the orb is still busy with what came before; try again in a moment"

Install = Callable[[Path, str | None], str]  # takes a file into use, a change of a named bundle


class Teacher:
    """Handler of teaching for the host on the link."""

    def __init__(
        self,
        updater: BundleUpdater,
        current: Callable[[], Parts],
        store: BundleStore,
        install: Install,
        folder: Path | None = None,
    ) -> None:
        """Teach the bundle of the current parts; examples lie in a folder of the user's data."""
        self.folder = files.data_folder() / "teaching" if folder is None else folder
        self._updater, self._current, self._store = updater, current, store
        self._install = install
        self._worker = Worker()
        bundle = current().bundle
        grid = bundle.rows, bundle.columns
        self._examples = ExampleStore(self.folder / "examples", grid, bundle.rate_hz)
        self._taker = ExampleTaker(self._examples, self._worker)
        self._progress = self._told = 0.0  # of the change under way, and as last sent
        self._changing = False
        self._recognised: dict[str, float] = {}  # of its outcome, by label
        self._recording = LinkRecording(self.folder / "recordings", self._worker)
        self._check = LinkCheck()

    def describe(self, parts: Parts) -> tuple[Message, ...]:
        """Return the description of the parts; BundleError, OSError."""
        objection = self._updater.objection
        return reports(bundle_path(parts.options), parts.mapping, self.folder, objection)

    def poll(self, device: Device) -> list[Message]:
        """Return new messages, without waiting."""
        bundle = self._current().bundle
        messages = self._worker.poll()
        if any(isinstance(m, Vocabulary) and m.labels != bundle.labels for m in messages):
            # The gestures have changed since.
            messages = [
                m for m in messages if not isinstance(m, Vocabulary | GestureInfo | UserInfo)
            ]
            messages += self._begin(self._described)
        self._recording.poll(device, bundle.hash)
        messages += [*self._taker.poll(device), *self._check.poll()]
        if self._progress != self._told:
            self._told = self._progress
            messages.append(LearnStatus(LEARNING, self._told, "learning"))
        return messages

    def take(self, message: Message, device: Device) -> list[Message]:
        """Take a request, and return messages that answer it at once."""
        if isinstance(message, Describe):
            return self._begin(self._described)
        if self._updater.objection:
            return [_refusal(message, self._updater.objection)]
        if isinstance(message, ExampleStart | ExampleEnd | ExampleDrop):
            return self._taker.take(message, device)
        if isinstance(message, Check):
            return self._check.take(message, device, bundle_path(self._current().options))
        if isinstance(message, Record | RecordLabel):
            return self._recording.take(message, device, self._current())
        if self._changing:
            return [LearnStatus(LEARNING, self._told, _BUSY)]  # its outcome is still to come
        if isinstance(message, DeleteExamples):
            return self._begin(self._delete)
        if isinstance(message, SaveAs):
            return self._begin(partial(self._save, message.name))
        if isinstance(message, InjectFault | Recalibrate):
            return _treat(message, device)
        return self._change(message)

    # --- work with files --------------------------------------------------------------------------

    def _described(self) -> Iterable[Message]:
        """Return the description of what is in use, and the pending examples."""
        try:
            described = self.describe(self._current())
        except (BundleError, OSError) as error:
            return [_failed(str(error))]
        if self._updater.objection:
            return described
        pending = sorted(self._examples.pending.values(), key=lambda one: one.number)
        return [*described, *(self._examples.report(one) for one in pending)]

    def _delete(self) -> Iterable[Message]:
        """Delete all pending examples and recordings."""
        examples = self._examples.delete()
        recordings = self._recording.delete()
        return [
            LearnStatus(
                DONE,
                1.0,
                f"examples deleted: {examples}, recordings: {recordings}; taught gestures keep "
                "theirs until they are forgotten",
            )
        ]

    def _save(self, name: str) -> Iterable[Message]:
        """Copy the bundle in use to a file of the user's data."""
        if not _NAME.fullmatch(name):
            return [_failed(f"{name!r} is no name; use letters, digits, - and _, 40 at most")]
        folder = self.folder / "saved"
        path = folder / f"{name}.orb"
        try:
            if folder.is_dir() and sum(1 for _ in folder.iterdir()) >= MOST_SAVED:
                return [_failed(f"there are {MOST_SAVED} saved already; delete some in {folder}")]
            data = bundle_path(self._current().options).read_bytes()
            files.atomic_write(path, data, replace=False)
        except FileExistsError:
            return [_failed(f"there is a {name!r} already; choose another name")]
        except OSError as error:
            return [_failed(f"the orb cannot keep it: {reason(error)}")]
        text = f"saved as {path}; `controller install FILE` takes it into use again"
        return [LearnStatus(DONE, 1.0, fitted(text, MAX_SENTENCE))]

    # --- changes of the bundle --------------------------------------------------------------------

    def _change(self, message: Message) -> list[Message]:
        """Begin to learn, forget or undo, or to set a command."""
        if self._updater.busy:
            return [_failed(_BUSY)]
        parts = self._current()
        if parts.runs is not None and not isinstance(message, SetCommand):
            return [_failed("this orb records, so its gestures stay as they are")]
        try:
            work = self._work(message, parts)
        except ValueError as error:
            return [_failed(str(error))]
        self._progress = self._told = 0.0
        self._recognised, self._changing = {}, True
        self._updater.begin(work, self._outcome)
        return [LearnStatus(LEARNING, 0.0, "learning")]

    def _work(self, message: Message, parts: Parts) -> Callable[[], str]:
        """Return what does a change; ValueError if it is not possible."""
        if isinstance(message, Undo):
            return self._undo
        labels = parts.bundle.labels[1:]
        if isinstance(message, SetCommand):
            return self._setting(message, parts)
        if isinstance(message, Forget) and message.label not in labels:
            raise BundleError(f"there is no gesture {message.label!r}")
        if isinstance(message, Forget):
            change = partial(few_shot.forget, label=message.label)
            return partial(self._forget, change, message.label)
        assert isinstance(message, Learn)
        _check_command(message.command)
        return self._learning(message)

    def _setting(self, message: SetCommand, parts: Parts) -> Callable[[], str]:
        """Return what sets a command, of everybody or of a user."""
        label, command, user = message.label, message.command, message.user
        if user and user not in parts.bundle.users.names:
            raise BundleError(f"there is no user {user!r}")
        if label not in parts.bundle.labels[1:] and (label or not user):
            raise BundleError(f"there is no gesture {label!r}")
        _check_command(command)
        if parts.options.mapping is not None:
            raise BundleError(f"the commands are those of {parts.options.mapping}; edit it")
        done = f"{label}: {command or 'nothing'}" if label else f"{user} has the commands of all"
        change = partial(commands.set_command, label=label, command=command, user=user)
        return partial(self._alter, change, done)

    def _learning(self, message: Learn) -> Callable[[], str]:
        """Return what learns a gesture from its pending examples."""
        if message.rotations not in TURNS:
            raise AdaptError(f"rotations {message.rotations!r} is none of {', '.join(TURNS)}")
        examples = tuple(
            replace(
                one.example,
                user=message.user,
                rotations=message.rotations,
                mirrored=message.mirrored,
            )
            for one in self._examples.of(message.label)
        )
        if not examples:
            raise AdaptError(f"there is no example of {message.label!r}; make some first")
        change = partial(few_shot.teach, examples=examples, command=message.command, again=True)
        done = f"{message.label} is learned from {count(len(examples), 'example')}"
        return partial(self._alter, change, done)

    def _forget(self, change: Change, label: str) -> str:
        """Forget a gesture and its pending examples; return a sentence."""
        done = self._alter(change, f"{label} is forgotten")
        self._examples.drop([one.number for one in self._examples.of(label)])
        return done

    def _alter(self, change: Change, done: str) -> str:
        """Change the bundle in use, on the updater's thread; return a sentence."""
        parts, before = self._current(), self._store.record().current
        made = process.alter(
            change,
            bundle_path(parts.options),
            self._store.folder / INCOMING,
            lambda out: self._install(out, before),
            self._advance,
        )
        self._recognised = dict(made.recognised)
        waits = made.debounce.patient
        if fresh := [label for label in waits if label not in parts.bundle.debounce.patient]:
            verb = "wait" if fresh[1:] else "waits"
            done = (
                f"{done}; {' and '.join(fresh)} now {verb} {made.debounce.patience_s:.2f} s for it"
            )
        return done

    def _advance(self, share: float) -> None:
        self._progress = 0.8 * share  # the rest is for the self-test

    def _undo(self) -> str:
        self._store.undo()
        return "the last change is undone"

    def _outcome(self, done: bool, text: str) -> Message:
        """Return the outcome of a change."""
        self._changing = False
        new, recognised = self._updater.loaded.parts, self._recognised
        labels = new.bundle.labels if done and recognised and new is not None else ()
        kept = tuple(recognised.get(label, 1.0) for label in labels)
        return LearnStatus(DONE if done else FAILED, 1.0, text, kept)

    def _begin(self, work: Callable[[], Iterable[Message]]) -> list[Message]:
        """Begin a work with files; return a message if there are too many."""
        return [] if self._worker.begin(work) else [_failed(_BUSY)]


def _check_command(command: str) -> None:
    """Raise BundleError if a command is neither "" nor a command's name."""
    if command and not _COMMAND.fullmatch(command):
        raise BundleError(f"{command!r} is no command, such as {COMMANDS[0]}")


def _treat(message: InjectFault | Recalibrate, device: Device) -> list[Message]:
    """Give the orb a fault, or measure it again."""
    try:
        if isinstance(message, InjectFault):
            device.sensor.inject(message.kind, message.row, message.column)
            return [LearnStatus(DONE, 1.0, f"the orb has a fault: {message.kind or 'none'}")]
        if device.recorder is not None:
            raise SensorError("the orb records now; stop the recording first")
    except SensorError as error:
        return [_failed(str(error))]
    device.pipeline.recalibrate()
    return [LearnStatus(DONE, 1.0, "the orb is measured again; do not touch it")]


def _refusal(message: Message, why: str) -> Message:
    """Return the answer to a request that is refused."""
    if isinstance(message, ExampleStart):
        return untaken(message.number, message.label, why)
    return LearnStatus(FAILED, 1.0, why)


def _failed(why: str) -> Message:
    return LearnStatus(FAILED, 1.0, fitted(why, MAX_SENTENCE))
