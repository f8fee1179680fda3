"""Changes of the bundle over the link, and what else a host asks for while teaching.

Nothing waits on the loop's thread: files are written by a `Worker`, and bundles are changed by a
`BundleUpdater`.
"""

from __future__ import annotations

import contextlib
import queue
import re
import threading
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from controller.adapt import AdaptError, few_shot, process
from controller.adapt.examples import TURNS
from controller.adapt.process import Change
from controller.bundles.container import BundleError
from controller.bundles.deploy.store import INCOMING, BundleStore
from controller.remote import link_recording
from controller.remote.bundle_updates import BundleUpdater
from controller.remote.examples import ExampleStore, untaken
from controller.remote.worker import BUSY, Worker, failed
from controller.runtime.assemble import Parts, bundle_path
from controller.runtime.device import Device
from controller.runtime.loop import Handler
from controller.sensors.base import Sensor
from controller.sensors.geometry import SensorError
from controller.shared import files
from controller.shared.errors import reason
from controller.shared.notices import listed, notice
from controller.shared.protocol.messages import COMMANDS, Message
from controller.shared.protocol.teaching import (
    DONE,
    FAILED,
    LEARNING,
    TEACHING,
    DeleteExamples,
    ExampleStart,
    Forget,
    InjectFault,
    Learn,
    LearnStatus,
    LessonCost,
    Recalibrate,
    SaveAs,
    SetCommand,
    SetStrength,
    SetWaiting,
    Undo,
)
from controller.shared.touch_strength import DECIMALS, scaled

MOST_SAVED: Final = 100  # bundles kept by SaveAs
_MEASURED_S: Final = 900.0  # in which the cost of a lesson is measured; slow devices take minutes
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,39}")
_COMMAND: Final = re.compile(r"[a-z][a-z0-9_]{0,39}")

Install = Callable[[Path, str | None], str]  # takes a file into use, a change of a named bundle


class Refusal(Handler):
    """Refuses all teaching, for a reason."""

    def __init__(self, objection: str) -> None:
        self._objection = objection

    def take(self, message: Message, device: Device) -> Sequence[Message] | None:
        """Return the refusal of a request of teaching."""
        if isinstance(message, ExampleStart):
            return [untaken(message.number, message.label, self._objection)]
        return [failed(self._objection)] if isinstance(message, TEACHING) else None


class Teacher(Handler):
    """Handler of changes of the bundle, of files about it, and of the virtual orb's faults."""

    def __init__(
        self,
        updater: BundleUpdater,
        current: Callable[[], Parts],
        store: BundleStore,
        install: Install,
        folder: Path,
        worker: Worker,
        examples: ExampleStore,
    ) -> None:
        """Teach the bundle of the current parts; `folder` has the user's data."""
        self._updater, self._current, self._store = updater, current, store
        self._install, self._folder, self._worker = install, folder, worker
        self._examples = examples
        self._progress = self._told = 0.0  # of the change under way, and as last sent
        self._changing = False
        self._learned = ""  # the gesture of the present change; "" of another one
        self._costs: queue.SimpleQueue[LessonCost] = queue.SimpleQueue()
        self._changes: dict[type[Message], Callable[[Any, Parts], Callable[[], str]]] = {
            Undo: lambda message, parts: self._undo,
            SetCommand: self._setting,
            SetStrength: self._strengthening,
            SetWaiting: self._waiting,
            Forget: self._forgetting,
            Learn: self._learning,
        }

    def poll(self, device: Device) -> Sequence[Message]:
        """Return the progress of the change under way when it has advanced, and new costs."""
        if not self._costs.empty():
            return [self._costs.get_nowait() for _ in range(self._costs.qsize())]
        if self._progress == self._told:
            return ()
        self._told = self._progress
        return [LearnStatus(LEARNING, self._told, notice("learning"))]

    def take(self, message: Message, device: Device) -> Sequence[Message] | None:
        """Take a request, and return messages that answer it at once."""
        if not isinstance(message, TEACHING):
            return None
        if self._changing:
            return [LearnStatus(LEARNING, self._told, BUSY)]  # its outcome is still to come
        match message:
            case DeleteExamples():
                return self._worker.begin(self._delete)
            case SaveAs():
                return self._worker.begin(partial(self._save, message.name))
            case InjectFault() | Recalibrate():
                return _treat(message, device)
        return self._change(message)

    # --- work with files --------------------------------------------------------------------------

    def _delete(self) -> Iterable[Message]:
        """Delete all pending examples and recordings."""
        examples = self._examples.delete()
        recordings = link_recording.delete(self._folder / "recordings")
        return [LearnStatus(DONE, 1.0, notice("deleted", examples, recordings))]

    def _save(self, name: str) -> Iterable[Message]:
        """Copy the bundle in use to a file of the user's data."""
        if not _NAME.fullmatch(name):
            return [failed(notice("no_name", name))]
        folder = self._folder / "saved"
        path = folder / f"{name}.orb"
        try:
            if folder.is_dir() and sum(1 for _ in folder.iterdir()) >= MOST_SAVED:
                return [failed(notice("many_saved", MOST_SAVED, folder))]
            data = bundle_path(self._current().options).read_bytes()
            files.atomic_write(path, data, replace=False)
        except FileExistsError:
            return [failed(notice("name_taken", name))]
        except OSError as error:
            return [failed(notice("cannot_keep", reason(error)))]
        return [LearnStatus(DONE, 1.0, notice("saved", path))]

    # --- changes of the bundle --------------------------------------------------------------------

    def _change(self, message: Message) -> list[Message]:
        """Begin to learn, forget or undo, or to set a command."""
        if self._updater.busy:
            return [failed(BUSY)]
        parts = self._current()
        if parts.runs is not None and not isinstance(message, SetCommand | SetStrength):
            return [failed(notice("keeps"))]
        try:
            work = self._changes[type(message)](message, parts)
        except ValueError as error:
            return [failed(str(error))]
        self._progress = self._told = 0.0
        self._changing = True
        self._learned = message.label if isinstance(message, Learn) else ""
        self._updater.begin(work, self._outcome)
        return [LearnStatus(LEARNING, 0.0, notice("learning"))]

    def _forgetting(self, message: Forget, parts: Parts) -> Callable[[], str]:
        """Return what forgets a gesture."""
        if message.label not in parts.bundle.labels[1:]:
            raise BundleError(notice("no_gesture", message.label))
        change = partial(few_shot.forget, label=message.label)
        return partial(self._forget, change, message.label)

    def _setting(self, message: SetCommand, parts: Parts) -> Callable[[], str]:
        """Return what sets a command, of everybody or of a user."""
        label, command, user = message.label, message.command, message.user
        if user and user not in parts.bundle.users.names:
            raise BundleError(notice("unknown_user", user))
        if label not in parts.bundle.labels[1:] and (label or not user):
            raise BundleError(notice("no_gesture", label))
        _check_command(command)
        if parts.options.mapping is not None:
            raise BundleError(notice("mapping_file", parts.options.mapping))
        done = f"{label}: {command or 'nothing'}" if label else notice("like_all", user)
        change = partial(process.set_command, label=label, command=command, user=user)
        return partial(self._alter, change, done)

    def _strengthening(self, message: SetStrength, parts: Parts) -> Callable[[], str]:
        """Return what sets a touch strength, of everybody or of a user."""
        user, strength = message.user, round(message.strength, DECIMALS)
        if user and user not in parts.bundle.users.names:
            raise BundleError(notice("unknown_user", user))
        common = parts.bundle.strength if user else 1.0
        done = notice("strength", strength or common)
        change = partial(process.set_strength, strength=strength, user=user)
        return partial(self._alter, change, done)

    def _waiting(self, message: SetWaiting, parts: Parts) -> Callable[[], str]:
        """Return what lets older gestures wait for a taught one, or not."""
        change = partial(few_shot.waiting, label=message.label, wait=message.wait)
        return partial(self._alter, change, notice("gesture", message.label))

    def _learning(self, message: Learn, parts: Parts) -> Callable[[], str]:
        """Return what learns a gesture from its pending examples; ValueError."""
        _check_command(message.command)
        if message.rotations not in TURNS:
            raise AdaptError(notice("no_rotations", message.rotations, ", ".join(TURNS)))
        examples = tuple(
            replace(
                one.example,
                images=scaled(one.example.images, parts.bundle.strength_of(message.user)),
                user=message.user,
                rotations=message.rotations,
                mirrored=message.mirrored,
            )
            for one in self._examples.of(message.label)
        )
        if not examples:
            raise AdaptError(notice("no_example", message.label))
        change = partial(few_shot.teach, examples=examples, command=message.command, again=True)
        code = "learned_all" if examples[1:] else "learned_one"
        done = notice(code, message.label, len(examples))
        return partial(self._alter, change, done)

    def _forget(self, change: Change, label: str) -> str:
        """Forget a gesture and its pending examples; return a sentence."""
        done = self._alter(change, notice("forgotten", label))
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
        waits = made.debounce.patient
        if fresh := [label for label in waits if label not in parts.bundle.debounce.patient]:
            older = listed(notice("gesture", label) for label in fresh)
            code = "wait" if fresh[1:] else "waits"
            done = notice("joined", done, notice(code, older, made.debounce.patience_s))
        return done

    def measure(self, path: Path, label: str, sensor: Sensor) -> None:
        """Measure what a lesson cost, on a thread; without success nothing is known.

        It is performed by the hand of a virtual orb, or by the usual one.
        """
        from controller.adapt import cost
        from controller.sensors.virtual import Virtual

        hand = cost.Hand()
        if isinstance(sensor, Virtual):
            hand = cost.Hand(sensor.seed or 0, sensor.quick, sensor.model)
        with contextlib.suppress(AdaptError, OSError):
            measure = partial(cost.measure, path, label, hand)
            for one in process.run(measure, deadline_s=_MEASURED_S):
                outcomes = (*one.before, *one.now, *one.eager)
                self._costs.put(LessonCost(label, one.label, one.of, *outcomes))

    def _advance(self, share: float) -> None:
        self._progress = 0.8 * share  # the rest is for the self-test

    def _undo(self) -> str:
        self._store.undo()
        return notice("undone")

    def _outcome(self, done: bool, text: str) -> Message:
        """Return the outcome of a change."""
        self._changing = False
        new = self._updater.loaded.parts
        if done and self._learned and new is not None:
            arguments = bundle_path(new.options), self._learned, new.sensor
            threading.Thread(target=self.measure, args=arguments, daemon=True).start()
        return LearnStatus(DONE if done else FAILED, 1.0, text)


def _check_command(command: str) -> None:
    """Raise BundleError if a command is neither "" nor a command's name."""
    if command and not _COMMAND.fullmatch(command):
        raise BundleError(notice("no_command", command, COMMANDS[0]))


def _treat(message: InjectFault | Recalibrate, device: Device) -> list[Message]:
    """Give the orb a fault, or measure it again."""
    try:
        if isinstance(message, InjectFault):
            device.sensor.inject(message.kind, message.row, message.column)
            return [LearnStatus(DONE, 1.0, notice("fault", message.kind or "none"))]
        if device.recorder is not None:
            raise SensorError(notice("records"))
    except SensorError as error:
        return [failed(str(error))]
    device.pipeline.recalibrate()
    return [LearnStatus(DONE, 1.0, notice("measured"))]
