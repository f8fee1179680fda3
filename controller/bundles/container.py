"""The file of a bundle: a canonical zip of parts, with their hashes.

    bundle.toml     settings: labels, sensor, preprocessing, debouncer, mapping, users, card
    embedding.onnx  the network window -> embedding
    head.npz        embedding -> probabilities, as trained (`head`)
    location.onnx   the network image -> touch; empty in a bundle without positions
    golden.npz      reference inputs and outputs (`golden`)
    user.onnx       the network window -> user; a bundle may lack this one and the next four
    contact.npz     how wide a contact is (`controller.recognition.contact_radius`)
    state.npz       what touches in each frame (`controller.recognition.contact`)
    rehearsal.npz   embeddings of the training (`controller.adapt.lessons`)
    taught.npz      rows of the head, and the examples that they were fitted to
    SHA256SUMS      hashes of all parts before it

Parts are stored uncompressed, one after the other, without dates and comments. The reader packs
them again and compares the bytes, so any changed bit is detected. The hash shows integrity;
authenticity comes from the channel that carried the file.
"""

import hashlib
import io
import stat
import zipfile
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from controller.shared import config, npz
from controller.shared.config import ConfigError
from controller.shared.errors import UserError
from controller.shared.npz import DAMAGE, ZipError, open_zip

FORMAT_VERSION = 7  # of bundle.toml and of the list of parts
MAX_BYTES = 64 << 20  # of the file, and of its unpacked arrays
MANIFEST, SUMS, GOLDEN = "bundle.toml", "SHA256SUMS", "golden.npz"
EMBEDDING, HEAD, LOCATION = "embedding.onnx", "head.npz", "location.onnx"
USER = "user.onnx"  # optional: the user network
CONTACT = "contact.npz"  # optional: the network of contacts' radii
STATE = "state.npz"  # optional: the network of what touches in each frame
# optional: embeddings of the training, for few-shot learning, and what was learned
REHEARSAL, TAUGHT = "rehearsal.npz", "taught.npz"
CONTENT = (EMBEDDING, HEAD, LOCATION, GOLDEN)
PARTS = (MANIFEST, *CONTENT, SUMS)  # in the order of the file; optional ones before SUMS

_MAX_PARTS = 64
_UNIX = 3  # system that made the file: APPNOTE.TXT, 4.4.2
_FILE = (stat.S_IFREG | 0o644) << 16


class BundleError(UserError, ValueError):
    """The bundle cannot be used; the message is one sentence with the reason."""


def unpack(data: bytes) -> dict[str, bytes]:
    """Return the parts of a bundle's file by name; BundleError if it is damaged."""
    try:
        with open_zip(io.BytesIO(data), len(data), _MAX_PARTS) as file:
            parts = {name: file.read(name) for name in file.namelist()}
        intact = pack(parts) == data
    except (*DAMAGE, ZipError, UnicodeError):  # the last: in a name
        intact = False
    if not intact:
        raise BundleError("is damaged, or something else; copy it again from where it came")
    if tuple(parts) != _in_order(parts):
        raise BundleError("is damaged: its parts are not those of a bundle")
    if _sums(parts) != parts[SUMS]:
        raise BundleError("is damaged: a part has not the hash in SHA256SUMS")
    return parts


def arrays_of(data: bytes, what: str) -> npz.Arrays:
    """Return the arrays in a part; BundleError if it is damaged."""
    try:
        return npz.unpack(data, MAX_BYTES)
    except npz.ZipError as error:
        raise BundleError(f"has {what} whose file {error}") from None


def check_arrays(what: str, arrays: npz.Arrays, shapes: Mapping[str, tuple[int, ...]]) -> None:
    """Raise BundleError unless arrays are finite float32 of these shapes; -1: any length."""
    if set(arrays) != set(shapes):
        raise BundleError(f"has {what} of {', '.join(arrays)}, not {', '.join(shapes)}")
    for name, shape in shapes.items():
        array = arrays[name]
        same = array.ndim == len(shape) and all(
            size in (own, -1) for size, own in zip(shape, array.shape, strict=True)
        )
        if array.dtype != np.float32 or not same or not np.isfinite(array).all():
            raise BundleError(
                f"has {what} with {name} of {array.dtype} {array.shape}; "
                f"expected are finite float32 {shape}"
            )


def pack(parts: Mapping[str, bytes]) -> bytes:
    """Return the canonical zip file of these parts, in this order."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for name, data in parts.items():
            info = zipfile.ZipInfo(name)  # dated 1980, the first date of the format
            info.create_system, info.external_attr = _UNIX, _FILE
            file.writestr(info, data)
    return buffer.getvalue()


def content(parts: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the parts for `bundle.write`, of those that `unpack` returned."""
    return {name: data for name, data in parts.items() if name not in (MANIFEST, SUMS)}


def manifest(text: bytes) -> dict[str, Any]:
    """Return the table of bundle.toml in the newest format; BundleError if it is none."""
    try:
        table = config.parse_toml(text)
    except ConfigError as error:
        raise BundleError(f"has a manifest that cannot be used: {error}") from None
    form = table.get("format")
    if type(form) is not int or form != FORMAT_VERSION:
        what = "train or teach it again if it is older, else update OrbTouch"
        raise BundleError(f"has format {form!r}, this program reads {FORMAT_VERSION}; {what}")
    return table


def complete(manifest: bytes, parts: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return all parts of a file, in order, with their sums; BundleError if one is missing."""
    if not set(CONTENT) <= set(parts):
        raise BundleError(f"has not the parts {', '.join(CONTENT)}, but {', '.join(parts)}")
    given = {MANIFEST: manifest, SUMS: b"", **parts}
    found = {name: given[name] for name in _in_order(given)}
    return {**found, SUMS: _sums(found)}


def _sums(parts: Mapping[str, bytes]) -> bytes:
    """Return the SHA-256 of every part but `SUMS`, in the format of the sha256sum tool."""
    digests = {name: hashlib.sha256(data).hexdigest() for name, data in parts.items()}
    lines = (f"{digest}  {name}\n" for name, digest in digests.items() if name != SUMS)
    return "".join(lines).encode()


def _in_order(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names of parts in the order of the file."""
    own = sorted(set(names) - set(PARTS), key=lambda name: (name != USER, name))
    return (MANIFEST, *CONTENT, *own, SUMS)
