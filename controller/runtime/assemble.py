"""The parts of a run, as the command line asks for them: each checked before anything runs.

At the top is imported what every run needs; what only some need, where they ask for it. A device
starts in half the time that way (docs/running.md).
"""

from __future__ import annotations

import logging
import os
import platform
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final, TextIO

import numpy as np

from controller import __version__
from controller.bundles import bundle as bundles
from controller.bundles import mapping_file
from controller.bundles.bundle import Bundle
from controller.bundles.deploy.store import BundleStore, name_of
from controller.bundles.inference.networks import Recognizer
from controller.errors import UserError
from controller.links import PRINT, Link, LinkError, open_link
from controller.protocol.codec import ProtocolError
from controller.protocol.messages import DEADMAN_MS, HEARTBEAT_MS, VERSION, Welcome
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import LATER, Pipeline
from controller.recognition.preprocess import Image, StoredBaseline
from controller.recordings.recording import RATE_TOLERANCE
from controller.runtime.device import Device, Wish, steady
from controller.runtime.long_press import WINDOW_S
from controller.runtime.realtime import IdleCollector
from controller.sensors import base as sensors
from controller.sensors.base import Sensor, SensorError

if TYPE_CHECKING:
    from argparse import Namespace

    from controller.capture.cue_plan import CuePlan
    from controller.capture.run_files import RunFiles
    from controller.keymap.terminal import Keyboard
    from controller.runtime.bundle_updates import BundleUpdater
    from controller.runtime.latency_report import LatencyReporter

TOKEN: Final = "ORBTOUCH_TOKEN"  # in the environment: what a host must say to the orb it started

_log = logging.getLogger("controller")


@dataclass(frozen=True, slots=True)
class Parts:
    """Everything that a run needs, checked.

    Attributes:
        options: As the user gave them.
        bundle: What is deployed.
        recognizer: Its networks.
        mapping: Its table, or an override of it.
        sensor: At its first frame, for the first session.
        link: Where messages go.
        owned: By the host that started this process.
        runs: Where recordings go; None: nowhere.
        plan: What shall be recorded; None: whatever happens.
        ledger: Where each frame's hops are kept; None: nowhere.
        sweeper: Collects garbage between frames; None: Python does, whenever it likes.
    """

    options: Namespace
    bundle: Bundle
    recognizer: Recognizer
    mapping: Mapping
    sensor: Sensor
    link: Link
    owned: bool
    runs: RunFiles | None
    plan: CuePlan | None
    ledger: TextIO | None
    sweeper: IdleCollector | None


# --- before the first frame -----------------------------------------------------------------------


def prepare(options: Namespace) -> Parts:
    """Return all parts, or raise one of our errors: each mistake is told before anything runs."""
    _exclude(options)
    bundle, engine, mapping, proved = _deployed(options)
    _check_user(options, bundle)
    plan = runs = None
    if options.record is not None:
        from controller.runtime import recording_session

        plan = recording_session.plan(options, bundle.labels)
    sensor = _sensor(options, bundle)
    recognizer = Recognizer(bundle, options.engine or engine, proved=proved)
    _pipeline(bundle, recognizer, mapping, sensor)  # a recording's state is tried out as well
    if options.record is not None:
        runs = recording_session.runs(options)
    token = os.environ.pop(TOKEN, "")
    link = open_link(
        options.link,
        _welcome(bundle, mapping, sensor),
        token=token,
        key=b"" if options.key is None else _key(options.key),
        exposed=options.unprotected,
    )
    ledger = None if options.ledger is None else _ledger(options.ledger)
    _log.info(
        "orbtouch %s on Python %s, %s, %s, bundle %.8s, %s at %g Hz",
        __version__, platform.python_version(), recognizer.engine, _system(), bundle.hash,
        sensor.device_id, sensor.rate_hz,
    )  # fmt: skip
    return Parts(
        options, bundle, recognizer, mapping, sensor, link, bool(token), runs, plan, ledger, None
    )


def _key(path: Path) -> bytes:
    """Return the key in a file."""
    from controller.protocol import psk

    return psk.read(path)


def _system() -> str:
    """Return what we run on, for the log; `platform.platform` looks for its C library as well."""
    return f"{platform.system()} {platform.release()} {platform.machine()}"


def _ledger(path: Path) -> TextIO:
    """Return the ledger's file, which must not exist.

    Raises:
        LinkError: It exists, or cannot be written.
    """
    from controller.runtime.latency_report import open_ledger

    try:
        return open_ledger(path)
    except FileExistsError:
        raise LinkError(f"{path} exists; name another file with --ledger") from None
    except OSError as error:
        raise LinkError(f"cannot write {path}: {error.strerror}; name another --ledger") from None


def renew(parts: Parts) -> Parts:
    """Return the parts with bundle and mapping read anew; the link stays, and its host is told.

    Raises:
        BundleError, MappingError, ...: One of our errors; the old parts are as they were.
    """
    options = parts.options
    bundle, engine, mapping, proved = _deployed(options)
    sensor = _sensor(options, bundle)
    recognizer = Recognizer(bundle, options.engine or engine, proved=proved)
    try:
        parts.link.renew(_welcome(bundle, mapping, sensor), "the orb has new settings")
    except ProtocolError as error:
        raise LinkError(f"{error}; use fewer or shorter labels and commands") from None
    _log.info("going on with bundle %.8s on %s", bundle.hash, recognizer.engine)
    return replace(parts, bundle=bundle, recognizer=recognizer, mapping=mapping, sensor=sensor)


def refreshed(parts: Parts) -> Parts | None:
    """Return the parts with the networks now in use; None: the bundle differs in more than these.

    Raises:
        BundleError, MappingError, ...: One of our errors; the old parts are as they were.
    """
    bundle, engine, mapping, proved = _deployed(parts.options)
    if _settings(bundle, mapping) != _settings(parts.bundle, parts.mapping):
        return None
    recognizer = Recognizer(bundle, parts.options.engine or engine, proved=proved)
    return replace(parts, bundle=bundle, recognizer=recognizer, mapping=mapping)


def exchange(parts: Parts, device: Device) -> None:
    """Give a running device the networks of `refreshed` parts; host and rest stay as they are.

    Raises:
        RecordingError: What follows cannot be recorded.
    """
    device.pipeline.exchange(parts.recognizer)
    if device.tape is not None and parts.runs is not None:
        from controller.runtime import recording_session

        device.tape.continue_in(recording_session.begin(parts, parts.runs, device.sensor))
    if device.timekeeper is not None:
        device.timekeeper.about |= _about(parts)
    _log.info("going on with bundle %.8s on %s", parts.bundle.hash, parts.recognizer.engine)


def _settings(bundle: Bundle, mapping: Mapping) -> tuple[object, ...]:
    """Return what a device has to begin anew for if it changes."""
    b = bundle
    return (
        b.labels, b.rows, b.columns, b.pitch_mm, b.rate_hz, b.window, b.preprocess, b.debounce,
        b.spread, b.users, b.tells, mapping,
    )  # fmt: skip


def _deployed(options: Namespace) -> tuple[Bundle, str, Mapping, bool]:
    """Return the bundle in use, the engine that runs it fastest here, and what gestures mean.

    At last whether these very bytes were asked all golden questions before: by `controller install`
    if they are the shelf's, by those who released the program if it is the bundle that ships.
    """
    if options.bundle is not None:
        path, engine, proved = options.bundle, "", False
        bundle = bundles.read(path)
    else:
        shelf = BundleStore()
        path, engine = shelf.current()
        installed = path.parent == shelf.folder
        try:
            bundle = bundles.read(path)
        except bundles.BundleError as error:
            way_out = "; `controller rollback` goes back to the one before" if installed else ""
            raise bundles.BundleError(f"{error}{way_out}") from None
        proved = not installed or path.stem == name_of(bundle)
    mapping = bundle.mapping
    if options.mapping is not None:
        own, people = mapping_file.read(options.mapping, bundle.labels)
        mapping = mapping.overridden(own)
        bundle = replace(bundle, users=bundle.users.overridden(own, people))
    return bundle, engine, mapping, proved


def _exclude(options: Namespace) -> None:
    """Refuse options that have no meaning together."""
    if options.replay is not None:
        if options.record is not None:
            raise UserError("a replay is a recording already; leave out --record")
        if options.rate is not None:
            raise UserError("a recording has its own rate; leave out --rate")
        if options.ledger is not None:
            raise UserError("a replay keeps no time that could be measured; leave out --ledger")
    if options.hand_of != ("", "") and (
        options.replay is not None or sensors.name_of(options.sensor) != "virtual"
    ):
        raise UserError("--hand-of is the virtual orb's own; leave it out, or say --sensor virtual")
    if options.link == PRINT and (options.key is not None or options.unprotected):
        raise UserError("--key and --unprotected are for hosts; say with --link where they come")
    if options.key is not None and options.unprotected:
        raise UserError("an orb with a key is protected; leave out --key or --unprotected")
    if options.record is None:
        for name in ("label", "cues"):
            if getattr(options, name):
                raise UserError(f"--{name} is for recordings; add --record")


def _check_user(options: Namespace, bundle: Bundle) -> None:
    """Refuse to play as somebody who is not enrolled; a recording may be of anybody."""
    if options.user and options.record is None and options.user not in bundle.users.names:
        known = ", ".join(bundle.users.names)
        whom = f"the bundle knows {known}" if known else "the bundle knows nobody (docs/users.md)"
        raise UserError(
            f"--user {options.user} is for recordings, and for people whom the bundle knows; "
            f"{whom}; add --record"
        )


def _sensor(options: Namespace, bundle: Bundle) -> Sensor:
    """Return the sensor that was asked for; the bundle must have been trained for its like."""
    wanted_hz = bundle.rate_hz if options.rate is None else options.rate
    if abs(wanted_hz / bundle.rate_hz - 1.0) > RATE_TOLERANCE:
        raise SensorError(
            f"--rate {wanted_hz:g} is more than 2 % from the bundle's {bundle.rate_hz:g} Hz; "
            "choose a bundle that was trained for it"
        )
    sensor = sensors.load(
        options.sensor if options.replay is None else sensors.REPLAY,
        wanted_hz,
        seed=options.seed,
        path=options.replay,
        preset=options.preset,
        fault=tuple(options.fault),
        gestures=_gestures(options),
        user=options.hand_of[0],
        day=_day(*options.hand_of),
        wiring=options.wiring,
    )
    sensor.refuse_misfit(bundle)
    grid = sensor.geometry
    if (grid.rows, grid.columns) != (bundle.rows, bundle.columns):
        raise SensorError(
            f"the sensor has {grid.rows}×{grid.columns} taxels, the bundle is for "
            f"{bundle.rows}×{bundle.columns}; choose another with --bundle"
        )
    return sensor


def _day(name: str, day: str) -> str:
    """Return the day on which somebody comes, as `controller teach --session DAY` calls it."""
    if not day:
        return ""
    from controller.recordings import naming

    return naming.first(name, day)


def _gestures(options: Namespace) -> tuple[Path, ...]:
    """Return files of gestures that the virtual orb's own hand can do beside those that ship.

    Raises:
        VocabularyError: The file that names them is no vocabulary.
    """
    if options.labels is None:
        return ()
    from controller.bundles import vocabulary

    return vocabulary.read(options.labels).files


def _welcome(bundle: Bundle, mapping: Mapping, sensor: Sensor) -> Welcome:
    """Return what the device says of itself."""
    return Welcome(
        version=VERSION,
        boot_nonce=int.from_bytes(os.urandom(4), "little"),
        device_id=sensor.device_id,
        name="OrbTouch",
        virtual=sensor.virtual,
        rows=bundle.rows,
        columns=bundle.columns,
        pitch_mm=sensor.geometry.pitch_mm,
        rate_hz=sensor.rate_hz,
        heartbeat_ms=HEARTBEAT_MS,
        deadman_ms=DEADMAN_MS,
        labels=bundle.labels,
        commands=bundle.users.commands(mapping),
    )


# --- a session ------------------------------------------------------------------------------------


def open_device(parts: Parts, session: int, keyboard: Keyboard | None = None) -> Device:
    """Return a device at its first frame; the first one takes the sensor that was checked."""
    options, bundle, link = parts.options, parts.bundle, parts.link
    sensor = parts.sensor if session == 1 else _sensor(options, bundle)
    pipeline = _pipeline(bundle, parts.recognizer, parts.mapping, sensor, options.user)
    if sensor.source is not None:
        return Device(sensor, pipeline, link, sensor.schedule(), live=False)
    tape = None
    if parts.runs is not None:
        from controller.runtime import recording_session

        tape = recording_session.tape(parts, parts.runs, sensor, pipeline, keyboard)
    script: Iterator[Wish] = iter(())
    obey = None
    if sensor.virtual and not link.touchable:
        from controller.capture.simulated_hand import CuedHand
        from controller.sensors.virtual import show

        if parts.plan is None:
            told = "shows every gesture; Ctrl-C ends it"
            script = show(bundle.labels, sensor.geometry, options.seed, _gestures(options))
        else:
            told = "does what the cues ask for"
            obey = CuedHand(sensor.geometry, options.seed, _gestures(options)).obey
        _log.info("nothing touches this orb, so its own hand %s", told)
    schedule = steady(sensor.rate_hz)
    press = None
    if tape is None and not sensor.virtual:
        press = partial(link.pair, WINDOW_S)
    return Device(
        sensor, pipeline, link, schedule, tape=tape, script=script, obey=obey, on_long_press=press,
        timekeeper=_timekeeper(parts, sensor),
    )  # fmt: skip


def clerk(parts: Parts) -> BundleUpdater | None:
    """Return who takes new bundles over the link; None where nobody can send any."""
    link, shelf = parts.link, BundleStore()
    if parts.options.link == PRINT or parts.options.replay is not None:
        return None
    from controller.bundles.deploy.upload import UploadReceiver
    from controller.runtime.bundle_updates import BundleUpdater

    objection = ""
    if not link.authenticated:
        objection = (
            "this link does not prove who is there; give orb and host the same --key FILE, or copy "
            "the bundle to the orb and run `controller install` there"
        )
    elif parts.options.bundle is not None:
        objection = "this orb was started with a --bundle of its own"
    return BundleUpdater(
        UploadReceiver(shelf.folder, objection),
        partial(_install, shelf),
        partial(_corrected, parts, shelf),
    )


def _install(shelf: BundleStore, path: Path, corrects: str | None = None) -> str:
    """Take a bundle that has come into use."""
    from controller.bundles.deploy.install import install

    return install(path, shelf, other_sensor=False, tell=_log.info, corrects=corrects)


def _corrected(parts: Parts, shelf: BundleStore, label: str, images: list[Image]) -> str:
    """Learn what the latest touch was; return what is in use then, a sentence."""
    from controller.adapt import correction  # a play without corrections needs none of it

    if label and label not in parts.bundle.labels:
        raise bundles.BundleError(f"there is no gesture {label!r}")
    return correction.correct(
        label,
        np.array(images, dtype=np.float32),
        parts.bundle.rate_hz,
        shelf,
        partial(_install, shelf),
    )


def _timekeeper(parts: Parts, sensor: Sensor) -> LatencyReporter:
    """Return who keeps the ledger of a session."""
    from controller.runtime.latency_report import LatencyReporter, status_file

    about = {"device": sensor.device_id, "link": parts.options.link, **_about(parts)}
    link = parts.link
    return LatencyReporter(
        1.0 / sensor.rate_hz,
        lambda pace: link.send(pace, 0) if link.connected else None,
        sweeper=parts.sweeper,
        file=parts.ledger,
        status=status_file(),
        about=about,
    )


def _about(parts: Parts) -> dict[str, object]:
    return {"bundle": parts.bundle.hash, "engine": parts.recognizer.engine}


def _pipeline(
    bundle: Bundle, recognizer: Recognizer, mapping: Mapping, sensor: Sensor, user: str = ""
) -> Pipeline:
    """Return a pipeline before its first frame; a recording's goes on where it was recorded."""
    source = sensor.source
    if source is None:
        return Pipeline(bundle, recognizer, mapping, _known(bundle, sensor), user)
    if source.origin.bundle != bundle.hash:
        return Pipeline(bundle, recognizer, mapping, None, user)
    pipeline = Pipeline(bundle, recognizer, mapping, None, source.origin.user)  # as it was said
    if set(source.state) | set(LATER) != set(pipeline.state()):
        _log.warning("another version of this program recorded this: it is replayed from rest")
        return pipeline
    try:
        pipeline.restore(source.state)
    except ValueError as error:
        raise UserError(f"the recording cannot be replayed: {error}") from None
    return pipeline


def _known(bundle: Bundle, sensor: Sensor) -> StoredBaseline | None:
    """Return what a calibration of this sensor found."""
    from controller.sensors import calibration_store

    kept = calibration_store.load(sensor.device_id)
    if kept is None or kept.rest.shape != (bundle.rows, bundle.columns):
        return None
    return kept.known
