"""Take a changed bundle into use: with a new run, or by the running device."""

from __future__ import annotations

import logging
from dataclasses import replace

from controller.bundles.bundle import Bundle
from controller.links.base import LinkError
from controller.runtime.assemble import Parts, deployed, next_file, sensor_of, welcome_of
from controller.runtime.device import Device
from controller.shared.protocol.codec import ProtocolError
from controller.shared.protocol.messages import Welcome
from controller.shared.protocol.packets import encode

_log = logging.getLogger("controller")


def renew(parts: Parts) -> Parts:
    """Return the parts with bundle and mapping read again; the link stays, its host reconnects.

    UserError if they cannot be used; the old parts are then unchanged.
    """
    bundle, mapping, recognizer = deployed(parts.options)
    sensor = sensor_of(parts.options, bundle)
    parts.link.renew(_checked(welcome_of(bundle, mapping, sensor)), "the orb has new settings")
    _log.info("now running bundle %.8s on %s", bundle.hash, recognizer.engine)
    return replace(parts, bundle=bundle, recognizer=recognizer, mapping=mapping, sensor=sensor)


def refreshed(parts: Parts) -> Parts | None:
    """Return the parts with the bundle now in use, or None if a running device cannot take it.

    UserError if it cannot be used.
    """
    bundle, mapping, recognizer = deployed(parts.options)
    same = _frames_of(bundle) == _frames_of(parts.bundle)
    if not same or (parts.runs is not None and bundle.labels != parts.bundle.labels):
        return None  # the label columns of a recording have its first labels
    _checked(welcome_of(bundle, mapping, parts.sensor))
    return replace(parts, bundle=bundle, recognizer=recognizer, mapping=mapping)


def _frames_of(bundle: Bundle) -> tuple[object, ...]:
    """Return what a bundle expects of its sensor, and how its images are made."""
    return bundle.rows, bundle.columns, bundle.pitch_mm, bundle.preprocess.plain


def _checked(welcome: Welcome) -> Welcome:
    """Return a description that fits in a packet, or raise LinkError."""
    try:
        encode(welcome, session=0, sequence=0, t_ms=0)
    except ProtocolError as error:
        raise LinkError(f"{error}; use fewer or shorter labels and commands") from None
    return welcome


def exchange(parts: Parts, device: Device) -> None:
    """Replace the bundle of a running device, and begin the next file of its recording."""
    device.pipeline.exchange(parts.bundle.settings, parts.recognizer, parts.mapping)
    parts.link.renew(welcome_of(parts.bundle, parts.mapping, device.sensor), "")
    if device.recorder is not None and parts.runs is not None:
        device.recorder.go_on(next_file(parts, parts.runs, device.sensor))
    _log.info("now running bundle %.8s on %s", parts.bundle.hash, parts.recognizer.engine)
