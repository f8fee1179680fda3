"""Identity of a bundle's behaviour: the hash of its networks and settings."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any, Final

from controller.bundles.bundle import Bundle
from controller.bundles.head import Head
from controller.recognition.contact import ContactNetwork
from controller.recognition.contact_radius import RadiusNetwork

SHORT: Final = 8  # digits that pages and captions show
# Networks are hashed by themselves; the others do not change what a device answers.
_NO_SETTINGS: Final = (
    "card",
    "golden",
    "hash",
    "embedding_onnx",
    "head",
    "location_onnx",
    "user_onnx",
    "radius",
    "contacts",
    "taught",
)


def fingerprint(bundle: Bundle) -> str:
    """Return the SHA-256 of a bundle's networks and settings, hexadecimal.

    Card, golden vectors, rehearsal and the form of the file have no part in it. Settings at their
    defaults have none either, so that it stays the same when the program knows further settings.
    """
    networks = {
        "embedding": bundle.embedding_onnx,
        "location": bundle.location_onnx,
        "user": bundle.user_onnx,
        "head": _numbers(bundle.head),
        **({} if bundle.radius is None else {"radius": _numbers(bundle.radius)}),
        **({} if bundle.contacts is None else {"contacts": _numbers(bundle.contacts)}),
        **{f"taught of {user}": _numbers(rows) for user, rows in bundle.taught.items()},
    }
    content = {
        "networks": {key: hashlib.sha256(data).hexdigest() for key, data in networks.items()},
        "settings": {
            one.name: _plain(getattr(bundle, one.name))
            for one in fields(bundle)
            if one.name not in _NO_SETTINGS and not _unset(bundle, one)
        },
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _numbers(network: Head | RadiusNetwork | ContactNetwork) -> bytes:
    """Return the arrays of a network, one after the other."""
    return b"".join(array.tobytes() for array in network.arrays().values())


def _unset(bundle: Bundle, one: Field[Any]) -> bool:
    """Return whether a setting that is no table of settings has its default."""
    value = getattr(bundle, one.name)
    return bool(value == one.default) and not is_dataclass(value)


def _plain(value: Any) -> Any:
    """Return settings as plain data, without those at their defaults."""
    if is_dataclass(value):
        found = {}
        for one in fields(value):
            default = one.default if one.default_factory is MISSING else one.default_factory()
            if (own := getattr(value, one.name)) != default:
                found[one.name] = _plain(own)
        return found
    if isinstance(value, Mapping):
        return {key: _plain(own) for key, own in value.items()}
    return [_plain(own) for own in value] if isinstance(value, tuple) else value
