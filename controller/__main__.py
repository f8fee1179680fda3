"""The command line: read what the user asks for, build the parts, and run the loop."""

import argparse
import json
import logging
import os
import platform
import secrets
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import count
from types import FrameType

from controller import bundle as bundles
from controller import mapping as mappings
from controller import sensors
from controller.bundle import Bundle, BundleError
from controller.links import Link, LinkError, open_link
from controller.links.stdout import let_go
from controller.loop import ORPHAN_S, Device, Loop, steady
from controller.mapping import Mapping, MappingError
from controller.options import PRINT, parser
from controller.pipeline import Pipeline
from controller.protocol import DEADMAN_MS, HEARTBEAT_MS, VERSION, Perform, Welcome
from controller.recognizer import Recognizer, engine
from controller.recordings.recorder import Recorder
from controller.recordings.recording import (
    RATE_TOLERANCE,
    Origin,
    RecordingError,
    refuse_misfit,
    software,
)
from controller.sensors import Sensor, SensorError, SensorOptions
from controller.sensors.replay import Replay
from controller.sensors.virtual import show

TOKEN = "ORBTOUCH_TOKEN"  # in the environment: what a host must say to the orb that it started

_log = logging.getLogger("controller")


def main(argv: Sequence[str] | None = None) -> int:
    """Run `controller` and return its exit status: 0 success, 1 trouble, 2 wrong usage."""
    options = parser().parse_args(argv)
    logging.basicConfig(format="%(message)s", level=logging.INFO, stream=sys.stderr)
    with _signals() as ends:
        try:
            parts = _prepare(options)
        except (BundleError, MappingError, RecordingError, SensorError, LinkError) as error:
            return _complain(error, 2)
        if parts.owned:
            threading.Thread(target=_watch_host, args=(ends,), name="owner", daemon=True).start()
        try:
            _run(parts, lambda: bool(ends))
        except (RecordingError, SensorError, LinkError) as error:
            return _complain(error, 1)
        finally:
            parts.link.close()
        problem: str = getattr(parts.link, "problem", "")
        return _complain(problem, 1) if problem else 0


def _complain(problem: Exception | str, status: int) -> int:
    print(f"controller: {problem}", file=sys.stderr)
    return status


@dataclass
class _Parts:
    """Everything that a run needs, checked."""

    options: argparse.Namespace
    bundle: Bundle
    recognizer: Recognizer
    mapping: Mapping
    sensor: Sensor  # at its first frame, for the first session
    link: Link
    owned: bool  # by the host that started this process


# --- before the first frame -----------------------------------------------------------------------


def _prepare(options: argparse.Namespace) -> _Parts:
    """Return all parts, or raise one of our errors: each mistake is told before anything runs."""
    if options.replay is not None:
        _exclude(options)
    bundle = bundles.read(options.bundle)
    mapping = bundle.mapping
    if options.mapping is not None:
        mapping = mapping.overridden(mappings.read(options.mapping, bundle.labels))
    sensor = _sensor(options, bundle)
    recognizer = Recognizer(bundle)
    _pipeline(bundle, recognizer, mapping, sensor)  # a recording's state is tried out as well
    if options.record is not None:  # the file is not written yet, but it must be possible
        Recorder(options.record, _origin(sensor, bundle), {})
    token = os.environ.pop(TOKEN, "")
    link = open_link(options.link, _welcome(bundle, mapping, sensor), token=token)
    _log.info(
        "orbtouch %s on Python %s, %s, bundle %.8s, %s at %g Hz",
        software(), platform.python_version(), engine(), bundle.hash,
        sensor.device_id, sensor.rate_hz,
    )  # fmt: skip
    return _Parts(options, bundle, recognizer, mapping, sensor, link, bool(token))


def _welcome(bundle: Bundle, mapping: Mapping, sensor: Sensor) -> Welcome:
    """Return what the device says of itself."""
    return Welcome(
        version=VERSION,
        boot_nonce=secrets.randbits(32),
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
        commands=mapping.commands,
    )


def _exclude(options: argparse.Namespace) -> None:
    """Refuse what has no meaning beside a recording."""
    if options.record is not None:
        raise RecordingError("a replay is a recording already; leave out --record")
    if options.rate is not None:
        raise RecordingError("a recording has its own rate; leave out --rate")


def _sensor(options: argparse.Namespace, bundle: Bundle) -> Sensor:
    """Return the sensor that was asked for; the bundle must have been trained for its like."""
    wanted_hz = bundle.rate_hz if options.rate is None else options.rate
    if abs(wanted_hz / bundle.rate_hz - 1.0) > RATE_TOLERANCE:
        raise SensorError(
            f"--rate {wanted_hz:g} is more than 2 % from the bundle's {bundle.rate_hz:g} Hz; "
            "choose a bundle that was trained for it"
        )
    name = options.sensor if options.replay is None else "replay"
    sensor = sensors.load(name, _sensor_options(options, wanted_hz))
    if isinstance(sensor, Replay):
        refuse_misfit(sensor.source, bundle)
    grid = sensor.geometry
    if (grid.rows, grid.columns) != (bundle.rows, bundle.columns):
        raise SensorError(
            f"the sensor has {grid.rows}×{grid.columns} taxels, the bundle is for "
            f"{bundle.rows}×{bundle.columns}; choose another with --bundle"
        )
    return sensor


def _sensor_options(options: argparse.Namespace, rate_hz: float) -> SensorOptions:
    return SensorOptions(
        rate_hz, options.seed, options.replay, options.preset, tuple(options.fault)
    )


def _origin(sensor: Sensor, bundle: Bundle) -> Origin:
    """Return what a recording will say of where it comes from."""
    grid = sensor.geometry
    return Origin(
        device_id=sensor.device_id,
        rows=grid.rows,
        columns=grid.columns,
        pitch_mm=grid.pitch_mm,
        rate_hz=sensor.rate_hz,
        labels=bundle.labels,
        bundle=bundle.hash,
        engine=engine(),
        software=software(),
    )


# --- the run --------------------------------------------------------------------------------------


def _run(parts: _Parts, stopped: Callable[[], bool]) -> None:
    """Run until stopped, or until the recording ends."""
    printing, replaying = parts.options.link == PRINT, parts.options.replay is not None
    if url := getattr(parts.link, "url", None):
        _announce(url)
    if printing and replaying:
        _replay(_device(parts, 1), stopped)
        return
    sessions = count(1)
    loop = Loop(
        parts.link,
        lambda: _device(parts, next(sessions)),
        time.monotonic,
        # What is simulated or recorded has no time of its own: it begins when somebody looks.
        await_host=not printing and (parts.sensor.virtual or replaying),
        orphan_s=ORPHAN_S if parts.owned else None,
    )
    # Whoever read the lines has gone (`controller | head`): that is an end as well.
    loop.run(lambda: stopped() or (printing and not parts.link.connected))
    if loop.missed:
        _log.info("%d frames were missed; is the machine too busy?", loop.missed)


def _announce(url: str) -> None:
    """Print where a host finds us, the first line of all."""
    try:
        print(json.dumps({"listening": url}), flush=True)
    except OSError as error:
        let_go(sys.stdout)
        raise LinkError(f"cannot print where this orb listens: {error.strerror}") from None


def _watch_host(ends: list[str]) -> None:
    """Note the host's end: it holds the other end of our standard input, however it dies."""
    with suppress(OSError):
        while os.read(0, 4096):
            pass
    ends.append("the host has gone")


def _replay(device: Device, stopped: Callable[[], bool]) -> None:
    """Take a whole recording through the pipeline, as fast as it can."""
    while device.due is not None and device.link.connected and not stopped():
        device.advance(device.sensor.rate_hz)
    device.close()


def _device(parts: _Parts, session: int) -> Device:
    """Return a device at its first frame; the first one takes the sensor that was checked."""
    options, bundle, link = parts.options, parts.bundle, parts.link
    sensor = parts.sensor if session == 1 else _sensor(options, bundle)
    pipeline = _pipeline(bundle, parts.recognizer, parts.mapping, sensor)
    if isinstance(sensor, Replay):
        return Device(sensor, pipeline, link, sensor.schedule(), live=False)
    recorder = None
    if options.record is not None:
        path = options.record
        if session > 1:  # time begins anew, and with it a file
            path = path.with_stem(f"{path.stem}-{session}")
        recorder = Recorder(path, _origin(sensor, bundle), pipeline.state())
    script: Iterator[tuple[float, Perform]] = iter(())
    if options.link == PRINT and sensor.virtual:
        _log.info("nothing touches this orb, so its own hand shows every gesture; Ctrl-C ends it")
        script = show(bundle.labels, sensor.geometry, options.seed)
    return Device(sensor, pipeline, link, steady(sensor.rate_hz), recorder=recorder, script=script)


def _pipeline(bundle: Bundle, recognizer: Recognizer, mapping: Mapping, sensor: Sensor) -> Pipeline:
    """Return a pipeline before its first frame; a recording's goes on where it was recorded."""
    pipeline = Pipeline(bundle, recognizer, mapping)
    if isinstance(sensor, Replay) and sensor.source.origin.bundle == bundle.hash:
        try:
            pipeline.restore(sensor.source.state)
        except ValueError as error:
            raise RecordingError(f"the recording cannot be replayed: {error}") from None
    return pipeline


@contextmanager
def _signals() -> Iterator[list[str]]:
    """Turn signals to end into reasons to end, in order: a recording is sealed, the host told."""
    reasons: list[str] = []
    numbers = [signal.SIGINT, signal.SIGTERM]
    hangup = getattr(signal, "SIGHUP", None)  # the terminal was closed; Windows has none
    if hangup is not None and signal.getsignal(hangup) is not signal.SIG_IGN:  # by nohup
        numbers.append(hangup)

    def handle(number: int, frame: FrameType | None) -> None:
        reasons.append(signal.Signals(number).name)

    before = {number: signal.signal(number, handle) for number in numbers}
    try:
        yield reasons
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


if __name__ == "__main__":
    sys.exit(main())
