"""Composition root of a run: its parts, built from the options and checked before the first frame.

Modules that only some runs need (recording, corrections, the simulated hand) are imported in the
function that builds them.
"""

from __future__ import annotations

import logging
import os
import platform
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from controller import __version__
from controller.bundles import bundle as bundles
from controller.bundles import users_table
from controller.bundles.bundle import Bundle
from controller.bundles.container import BundleError
from controller.bundles.deploy.store import BundleStore
from controller.bundles.inference.networks import Recognizer
from controller.links import PRINT, open_link
from controller.links.base import Link
from controller.recognition.images.frames import same_rate
from controller.recognition.mapping import Mapping
from controller.recognition.pipeline import Pipeline
from controller.recordings import reader
from controller.recordings.recording import refuse_misfit
from controller.runtime.device import Device, VirtualHand
from controller.runtime.latency import LatencyReporter
from controller.sensors import base as sensors
from controller.sensors import calibration_store
from controller.sensors.base import Sensor
from controller.sensors.geometry import SensorError
from controller.shared.errors import UserError
from controller.shared.protocol import psk
from controller.shared.protocol.messages import DEADMAN_MS, HEARTBEAT_MS, VERSION, Welcome

if TYPE_CHECKING:
    from controller.capture.session_recorder import RunFiles, SessionRecorder
    from controller.recordings.recorder import Recorder
    from controller.shared.aliases import State

TOKEN: Final = "ORBTOUCH_TOKEN"  # environment variable: token of the host that started this process

_log = logging.getLogger("controller")


@dataclass(frozen=True, slots=True)
class RunOptions:
    """Options of a plain run, as `controller --help` describes them."""

    sensor: str = "virtual"
    seed: int = 1
    preset: str = "nominal"
    fault: tuple[str, ...] = ()
    bundle: Path | None = None
    mapping: Path | None = None
    link: str = PRINT
    key: Path | None = None
    record: Path | None = None
    user: str = ""
    session: str = "1"
    label: str = ""
    replay: Path | None = None
    rate: float | None = None
    seconds: float | None = None  # of the sensor's time, after which a recording ends


@dataclass(frozen=True, slots=True)
class Parts:
    """Checked parts of a run."""

    options: RunOptions  # of the command line
    bundle: Bundle  # the one in use
    recognizer: Recognizer  # its networks
    mapping: Mapping  # its mapping, or an override of it
    sensor: Sensor  # the sensor of the first session, before its first frame
    link: Link  # the link for messages
    owned: bool  # whether a host started this process
    runs: RunFiles | None  # files for recordings; None: no recording


# --- before the first frame -----------------------------------------------------------------------


def prepare(options: RunOptions) -> Parts:
    """Return all parts of a run, or raise UserError."""
    bundle, mapping, recognizer = deployed(options)
    sensor = sensor_of(options, bundle)
    if not same_rate(sensor.rate_hz, bundle.rate_hz):  # it cannot be read as fast
        sensor.close()
        options = _slower(options, bundle, sensor.rate_hz)
        bundle, mapping, recognizer = deployed(options)
        sensor = sensor_of(options, bundle)
    _check_names(options, bundle)
    _pipeline(bundle, recognizer, mapping, sensor)  # a recording's state is tested, too
    runs = None
    if options.record is not None:
        from controller.capture.session_recorder import RunFiles

        runs = RunFiles(options.record, options.user, options.session)
    token = os.environ.pop(TOKEN, "")
    link = open_link(
        options.link,
        welcome_of(bundle, mapping, sensor),
        token=token,
        key=b"" if options.key is None else psk.read_or_make(options.key),
    )
    # Not `platform.platform`, which searches for the C library, too.
    system = f"{platform.system()} {platform.release()} {platform.machine()}"
    _log.info(
        "orbtouch %s on Python %s, %s, %s, bundle %.8s, %s at %g Hz",
        __version__,
        platform.python_version(),
        recognizer.engine,
        system,
        bundle.hash,
        sensor.device_id,
        sensor.rate_hz,
    )
    return Parts(options, bundle, recognizer, mapping, sensor, link, bool(token), runs)


def deployed(options: RunOptions) -> tuple[Bundle, Mapping, Recognizer]:
    """Return the bundle in use, its mapping or an override, and its networks.

    If an installed one cannot be used, it is the one that ships, with a warning.
    """
    store, path = BundleStore(), bundle_path(options)
    installed = options.bundle is None and path.parent == store.folder
    try:
        bundle = bundles.read(path)
    except BundleError as error:
        if not installed:
            raise
        _log.warning("%s; the bundle that ships is used, until `controller install BUNDLE`", error)
        bundle = bundles.read(bundles.default_path(_rate(options)))
    mapping = bundle.mapping
    if options.mapping is not None:
        own, people = users_table.read_mapping(options.mapping, bundle.labels)
        mapping = mapping.overridden(own)
        bundle = replace(bundle, users=bundle.users.overridden(own, people))
    return bundle, mapping, Recognizer(bundle)


def bundle_path(options: RunOptions) -> Path:
    """Return the file of the bundle in use."""
    if options.bundle is not None:
        return options.bundle
    store = BundleStore()
    try:
        path = store.current()
    except BundleError as error:
        _log.warning("%s; until then the bundle that ships is used", error)
        return bundles.default_path(_rate(options))
    return path if path.parent == store.folder else bundles.default_path(_rate(options))


def _rate(options: RunOptions) -> float | None:
    """Return the frames per second that the options ask for; None: they do not say."""
    if options.replay is None:
        return options.rate
    return reader.survey(options.replay).origin.rate_hz


def _slower(options: RunOptions, bundle: Bundle, most_hz: float) -> RunOptions:
    """Return the options for a sensor that is slower than the bundle needs.

    SensorError unless the shipped bundle is in use, and the other one is slow enough.
    """
    slow_hz = bundles.SLOW_HZ
    shipped = BundleStore().current() == bundles.default_path()
    if options.bundle is not None or options.rate is not None or not shipped or most_hz < slow_hz:
        raise SensorError(
            f"the sensor gives at most {most_hz:g} frames a second, the bundle needs "
            f"{bundle.rate_hz:g}; shorten [times] of its wiring, or choose a slower bundle"
        )
    _log.warning("it is read at %g Hz, with the bundle for that", slow_hz)
    return replace(options, rate=slow_hz)


def _check_names(options: RunOptions, bundle: Bundle) -> None:
    """Raise UserError for a label or a player that the bundle does not know."""
    if options.label and options.label not in bundle.labels[1:]:
        raise UserError(
            f"there is no label {options.label!r}; there are {', '.join(bundle.labels[1:])}"
        )
    if options.user and options.record is None and options.user not in bundle.users.names:
        known = ", ".join(bundle.users.names) or "none (orbtouch docs users)"
        raise UserError(
            f"--user {options.user} is for recordings, and for users enrolled in the bundle; "
            f"enrolled are {known}; add --record"
        )


def sensor_of(options: RunOptions, bundle: Bundle) -> Sensor:
    """Return the sensor of the options; its grid and rate must be those of the bundle."""
    wanted_hz = bundle.rate_hz if options.rate is None else options.rate
    if not same_rate(wanted_hz, bundle.rate_hz):
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
        fault=options.fault,
    )
    if sensor.source is not None:
        refuse_misfit(sensor.source, bundle.settings)
    grid = sensor.geometry
    if (grid.rows, grid.columns) != (bundle.rows, bundle.columns):
        raise SensorError(
            f"the sensor has {grid.rows}×{grid.columns} taxels, the bundle is for "
            f"{bundle.rows}×{bundle.columns}; choose another with --bundle"
        )
    return sensor


def welcome_of(bundle: Bundle, mapping: Mapping, sensor: Sensor) -> Welcome:
    """Return the device's description for its hosts."""
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


def open_device(parts: Parts, session: int) -> Device:
    """Return a device before its first frame; the first one has the sensor already checked."""
    options, bundle, link = parts.options, parts.bundle, parts.link
    sensor = parts.sensor if session == 1 else sensor_of(options, bundle)
    pipeline = _pipeline(bundle, parts.recognizer, parts.mapping, sensor, options.user)
    if (source := sensor.source) is not None:
        schedule = zip(source.sequence.tolist(), source.t.tolist(), strict=True)
        return Device(sensor, pipeline, link, schedule=schedule)
    recorder = None if parts.runs is None else _recorder(parts, parts.runs, sensor, pipeline)
    latency = LatencyReporter(
        1.0 / sensor.rate_hz,
        lambda report: link.send(report, round(device.now_s * 1000)) if link.connected else None,
    )
    hand = _hand(parts, sensor)
    device = Device(sensor, pipeline, link, recorder=recorder, hand=hand, latency=latency)
    return device


def _recorder(parts: Parts, runs: RunFiles, sensor: Sensor, pipeline: Pipeline) -> SessionRecorder:
    """Return the recorder of a session from its first frame on."""
    from controller.capture.labels import Labeller
    from controller.capture.session_recorder import SessionRecorder

    labeller = Labeller(parts.bundle.labels, button_label=parts.options.label)
    return SessionRecorder(next_file(parts, runs, sensor), pipeline, labeller)


def next_file(parts: Parts, runs: RunFiles, sensor: Sensor) -> Callable[[State], Recorder]:
    """Return a function that begins the next file of a recording without cues."""
    from controller.capture.session_recorder import provenance
    from controller.recordings.recorder import Recorder

    bundle, options, engine = parts.bundle, parts.options, parts.recognizer.engine
    user, session = options.user, options.session
    origin = provenance(sensor, bundle.labels, bundle.hash, engine, user, session, "free")
    return lambda state: runs.begin(lambda path: Recorder(path, origin, state))


def _hand(parts: Parts, sensor: Sensor) -> VirtualHand | None:
    """Return the simulated hand; None if a host touches the orb, or if it is real."""
    if parts.link.touchable or not sensor.virtual:
        return None
    from controller.sensors.virtual import show

    gestures = getattr(sensors.options(parts.options.sensor), "gestures", ())
    _log.info("no host touches this orb, so the simulated hand shows every gesture; Ctrl-C ends it")
    return VirtualHand(show(parts.bundle.labels, sensor.geometry, sensor.seed or 0, gestures))


def _pipeline(
    bundle: Bundle, recognizer: Recognizer, mapping: Mapping, sensor: Sensor, user: str = ""
) -> Pipeline:
    """Return a pipeline before its first frame; a recording's goes on where it was recorded."""
    settings, source, signal = bundle.settings, sensor.source, sensor.signal
    if source is None:
        kept = calibration_store.load(sensor.device_id)
        fits = kept is not None and kept.rest.shape == (bundle.rows, bundle.columns)
        known = kept.known(bundle.rate_hz) if kept is not None and fits else None
        signal = replace(signal, learned=calibration_store.scale(sensor.device_id))
        return Pipeline(settings, recognizer, mapping, known, user, signal)
    if source.origin.bundle != bundle.hash:
        return Pipeline(settings, recognizer, mapping, None, user, signal)
    pipeline = Pipeline(settings, recognizer, mapping, None, source.origin.user, signal)
    own = set(pipeline.state())
    if set(source.state) != own:
        _log.warning(
            "another program version made this recording: it is replayed without its initial state"
        )
        return pipeline
    try:
        pipeline.restore(source.state)
    except ValueError as error:
        raise UserError(f"the recording cannot be replayed: {error}") from None
    return pipeline
