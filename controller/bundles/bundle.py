"""Deployable bundles: one file `NAME.orb` with networks, labels, settings and golden vectors.

A bundle with enrolled users (`users_table`) also has the user network, and
gesture networks of single users. It is a zip in the one form that `archive` reads, so any changed
bit is found. The hash proves integrity; authenticity comes from the channel that carried the file.
"""

import hashlib
import os
from collections.abc import Iterable
from collections.abc import Mapping as AbstractMapping
from dataclasses import dataclass, field, fields
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from controller import config
from controller.bundles import archive, users_table
from controller.bundles import golden as goldens
from controller.bundles.golden import Golden, GoldenError
from controller.config import ConfigError
from controller.console import one_line
from controller.errors import UserError, reason
from controller.files import atomic_write, open_regular
from controller.recognition.debounce import DebounceSettings
from controller.recognition.frames import PreprocessSettings
from controller.recognition.mapping import Mapping, MappingError
from controller.recognition.mapping import parse as parse_mapping
from controller.recognition.pipeline import PipelineSettings
from controller.recognition.touch_position import PositionSpread
from controller.recognition.user_id import NO_USERS, Users

FORMAT = 4  # of bundle.toml and of the list of parts
READABLE = (1, 2, 3, FORMAT)  # the older ones have fewer settings and no users
MAX_BYTES = 64 << 20  # of the file, and of its unpacked arrays
MANIFEST, SUMS, GOLDEN = "bundle.toml", "SHA256SUMS", "golden.npz"
REHEARSAL = "rehearsal.npz"  # optional: what is rehearsed while more is learned
CONTENT = ("gesture.onnx", "location.onnx", GOLDEN)
PARTS = (MANIFEST, *CONTENT, SUMS)  # in the order of the file; users' networks before SUMS
# Formats 1 and 2 held the weights once more, in files that are not read: ONNX holds them.
_DROPPED = ("gesture.npz", "location.npz")
_OLD_PARTS = (MANIFEST, CONTENT[0], _DROPPED[0], CONTENT[1], _DROPPED[1], GOLDEN, SUMS)

_OTHERS = ("format", "mapping", "users")  # entries of a manifest with readers of their own
_ENDS = 200, 150  # characters kept of a long message: what was found, and what was expected


class BundleError(UserError, ValueError):
    """The bundle cannot be used; the message is one sentence with the reason."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BundleSettings:
    """The plain settings of a bundle, as bundle.toml has them.

    Attributes:
        labels: The gestures, "null" first, in the order of the network's outputs.
        rows: Taxel rows of the sensor for which it was trained.
        columns: Taxel columns.
        pitch_mm: Distance of two taxels.
        rate_hz: Frames per second.
        window: Images in a window.
        preprocess: Settings of the windows.
        debounce: Settings of the debouncer.
        card: Origin: data, accuracy, date, as its maker wrote it.
        spread: Deviation of touch positions; None if it was not measured.
    """

    labels: tuple[str, ...] = field(
        metadata={
            "pattern": r"[a-z][a-z0-9_]{0,39}",  # 40 characters fit in a packet
            "count": (2, 64),
            "expected": '2 to 64 different names in small letters, "null" first',
        }
    )
    rows: int = field(metadata={"range": (1, 30)})  # 900 taxels fit in a packet of telemetry
    columns: int = field(metadata={"range": (1, 30)})
    pitch_mm: float = field(metadata={"range": (0.1, 1000.0)})
    rate_hz: float = field(metadata={"range": (0.1, 1000.0)})
    window: int = field(metadata={"range": (1, 250)})
    preprocess: PreprocessSettings
    debounce: DebounceSettings
    card: dict[str, Any]
    spread: PositionSpread | None = field(default=None, metadata={"key": "location"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Bundle(BundleSettings):
    """A bundle that was read and found whole.

    Attributes:
        mapping: Commands of the gestures.
        gesture_onnx: The network window -> probabilities.
        location_onnx: The network image -> touch; empty in a bundle without positions.
        golden: Questions and answers that prove the networks on this machine.
        hash: SHA-256 of the file, hexadecimal.
        users: Enrolled users and their settings.
        user_onnx: The network window -> user; empty in a bundle that cannot identify users.
        heads: Users' own networks window -> probabilities, by name.
    """

    mapping: Mapping
    gesture_onnx: bytes
    location_onnx: bytes
    golden: Golden
    hash: str
    users: Users = NO_USERS
    user_onnx: bytes = b""
    heads: AbstractMapping[str, bytes] = field(default_factory=dict)

    @property
    def settings(self) -> PipelineSettings:
        """Settings of the pipeline's stages."""
        return PipelineSettings(
            self.labels, self.rows, self.columns, self.preprocess, self.debounce, self.spread,
            self.users, self.identifies,
        )  # fmt: skip

    @property
    def locates(self) -> bool:
        """Whether it has positions of touches."""
        return bool(self.location_onnx)

    @property
    def identifies(self) -> bool:
        """Whether it identifies users."""
        return bool(self.user_onnx)


def default_path() -> Path:
    """Return the path of the bundle that ships with the program."""
    models = find_spec("models")  # which is not imported: it is another package
    assert models is not None
    assert models.origin is not None
    return Path(models.origin).with_name("orbtouch.orb")


def read(path: Path) -> Bundle:
    """Return the bundle in a file, every byte of it checked.

    Raises:
        BundleError: There is no such file, or anything in it is not as it was written.
    """
    try:
        return parse(_content(path))
    except BundleError as error:
        raise BundleError(f"the bundle {path} {_cut(one_line(str(error)))}") from None


def parse(data: bytes) -> Bundle:
    """Return the bundle in the bytes of a file, every one of them checked.

    Raises:
        BundleError: Anything in it is not as it was written; the message has no subject.
    """
    return _parse(unpack(data), hashlib.sha256(data).hexdigest())


def unpack(data: bytes) -> dict[str, bytes]:
    """Return the parts of a bundle's file, by name: `PARTS`, and users' networks.

    Raises:
        BundleError: They are not as they were packed.
    """
    try:
        parts = archive.unpack(data)
    except archive.ArchiveError as error:
        raise BundleError(str(error)) from None
    if tuple(parts) not in (_OLD_PARTS, _in_order(parts)):
        raise BundleError("is damaged: its parts are not those of a bundle")
    if archive.sums(parts, SUMS) != parts[SUMS]:
        raise BundleError("is damaged: a part has not the hash in SHA256SUMS")
    return {name: data for name, data in parts.items() if name not in _DROPPED}


def content(parts: AbstractMapping[str, bytes]) -> dict[str, bytes]:
    """Return the parts that `write` takes, of those that `unpack` gives."""
    return {name: data for name, data in parts.items() if name not in (MANIFEST, SUMS)}


def manifest(text: bytes) -> dict[str, Any]:
    """Return the table of bundle.toml, in the newest format.

    Raises:
        BundleError: It is no TOML, too large, or of an unknown format.
    """
    try:
        table = config.parse_toml(text)
    except ConfigError as error:
        raise BundleError(f"has a manifest that cannot be used: {error}") from None
    form = table.get("format")
    if type(form) is not int or form not in READABLE:
        raise BundleError(
            f"has format {form!r}, this program reads {READABLE[0]} to {READABLE[-1]}; "
            "update the older one"
        )
    return {**table, "format": FORMAT}


def write(path: Path, *, manifest: bytes, parts: AbstractMapping[str, bytes]) -> None:
    """Write a bundle, complete or not at all; what the path held before is replaced.

    Args:
        path: Where to; `NAME.orb`.
        manifest: The text of bundle.toml, UTF-8.
        parts: The bytes of each name in `CONTENT`, and of users' networks by the names that
            `controller/bundles/users_table.py` gives them, as far as the manifest names users.

    Raises:
        BundleError: The result would be refused by `read`.
        OSError: The file cannot be written.
    """
    if not set(CONTENT) <= set(parts):
        raise BundleError(f"a bundle has the parts {', '.join(CONTENT)}, not {', '.join(parts)}")
    given = {MANIFEST: manifest, SUMS: b"", **parts}
    whole = {name: given[name] for name in _in_order(given)}
    whole[SUMS] = archive.sums(whole, SUMS)
    data = archive.pack(whole)
    try:
        _check_size(len(data))
        _parse(whole, hashlib.sha256(data).hexdigest())
    except BundleError as error:
        raise BundleError(f"the bundle for {path} {error}") from None
    atomic_write(path, data)


def _content(path: Path) -> bytes:
    """Return the bytes of a regular file of reasonable size."""
    try:
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            _check_size(size)
            return file.read(size)
    except FileNotFoundError:
        raise BundleError("does not exist; check its name") from None
    except OSError as error:
        raise BundleError(f"cannot be read: {reason(error)}; name a file NAME.orb") from None


def _check_size(size: int) -> None:
    if size > MAX_BYTES:
        raise BundleError(f"has {size} bytes, more than the {MAX_BYTES} allowed")


def _cut(problem: str) -> str:
    """Return a message without its middle, where it holds a value as long as a manifest."""
    first, last = _ENDS
    if len(problem) <= first + last:
        return problem
    return f"{problem[:first]} ... {problem[-last:]}"


def _parse(parts: AbstractMapping[str, bytes], digest: str) -> Bundle:
    """Return the bundle that whole parts make, every field checked."""
    table = manifest(parts[MANIFEST])
    located, told = bool(parts["location.onnx"]), bool(parts.get(users_table.NETWORK))
    try:
        plain = _settings(table)
        mapping = parse_mapping(_rules(table.get("mapping")), plain.labels)
        known = users_table.parse(table.get("users"), plain.labels)
        _check_parts(set(content(parts)), known)
        golden = goldens.read(
            parts[GOLDEN], (plain.window, plain.rows, plain.columns), len(plain.labels),
            located=located, users=known, told=told, most=MAX_BYTES,
        )  # fmt: skip
    except MappingError as error:
        raise BundleError(f"has a [mapping] that cannot be used: {error}") from None
    except (ConfigError, GoldenError) as error:
        raise BundleError(str(error)) from None
    if not located and not all(_everywhere(m) for m in (mapping, *known.mappings.values())):
        raise BundleError("maps gestures by their place, but has no location network")
    return Bundle(
        **{entry.name: getattr(plain, entry.name) for entry in fields(plain)},
        mapping=mapping,
        gesture_onnx=parts["gesture.onnx"],
        location_onnx=parts["location.onnx"],
        golden=golden,
        hash=digest,
        users=known,
        user_onnx=parts.get(users_table.NETWORK, b""),
        heads={name: parts[users_table.head_part(name)] for name in known.heads},
    )


def _settings(table: dict[str, Any]) -> BundleSettings:
    """Return the plain settings of a manifest, every field checked.

    Raises:
        BundleError, ConfigError: One of them cannot be used.
    """
    own = {key: value for key, value in table.items() if key not in _OTHERS}
    plain = config.settings(BundleSettings, own)
    if plain.labels[0] != "null":
        raise BundleError(f'has the labels {", ".join(plain.labels)}; expected is "null" first')
    if (plain.preprocess.window, plain.preprocess.rate_hz) != (plain.window, plain.rate_hz):
        raise BundleError("names one window and rate at its top and others under [preprocess]")
    added = plain.card.get("added", [])  # notes of lessons; the rest of the card is its maker's
    if not isinstance(added, list):
        raise BundleError(f"has added = {added!r} under [card]; expected is a list")
    return plain


def _rules(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise BundleError("has no table [mapping] in its manifest")
    return value


def _everywhere(mapping: Mapping) -> bool:
    """Whether no rule depends on the place of a touch."""
    return all(rules[-1:] == rules for rules in mapping.rules.values())


def _check_parts(given: set[str], known: Users) -> None:
    """Refuse parts that the manifest does not name, and the lack of others."""
    wanted = {*CONTENT, *(users_table.head_part(name) for name in known.heads)}
    if known.names:
        wanted.add(users_table.NETWORK)
    if odd := ", ".join(sorted((wanted ^ given) - {REHEARSAL})):
        raise BundleError(f"has other parts than its manifest says ({odd}); write it again")


def _in_order(names: Iterable[str]) -> tuple[str, ...]:
    """Return the parts of a file in the one order that they have there."""
    own = sorted(set(names) - set(PARTS), key=lambda name: (name != users_table.NETWORK, name))
    return (MANIFEST, *CONTENT, *own, SUMS)
