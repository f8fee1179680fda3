"""Deployable bundles: one file `NAME.orb` with networks, labels, settings and golden vectors.

A bundle with enrolled users (`controller/recognition/users.py`) also has the user network, and
gesture networks of single users. It is a zip in the one form that `archive` reads, so any changed
bit is found. The hash proves integrity; authenticity comes from the channel that carried the file.
"""

import dataclasses
import hashlib
import os
import re
from collections.abc import Iterable
from collections.abc import Mapping as AbstractMapping
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

from controller.bundles import archive
from controller.bundles import golden as goldens
from controller.bundles.golden import Golden, GoldenError
from controller.config import ConfigError, parse_toml
from controller.console import one_line
from controller.errors import UserError, reason
from controller.files import atomic_write, open_regular
from controller.recognition import users
from controller.recognition.debounce import DebounceSettings
from controller.recognition.mapping import Mapping, MappingError
from controller.recognition.mapping import parse as parse_mapping
from controller.recognition.preprocess import PreprocessSettings
from controller.recognition.touch_position import PositionSpread
from controller.recognition.users import NOBODY, Users, UsersError

FORMAT = 4  # of bundle.toml and of the list of parts
# Form 1 did not say how z is made: by the ratio. Form 3 and those before it knew no users.
READABLE = (1, 2, 3, FORMAT)
MAX_BYTES = 64 << 20  # of the file, and of what its arrays unpack to
MANIFEST, SUMS, GOLDEN = "bundle.toml", "SHA256SUMS", "golden.npz"
REHEARSAL = "rehearsal.npz"  # may be there: what is rehearsed while more is learned
CONTENT = ("gesture.onnx", "location.onnx", GOLDEN)
PARTS = (MANIFEST, *CONTENT, SUMS)  # in the order of the file; users' networks before SUMS
# Forms 1 and 2 held the weights once more, in files that nobody needs: ONNX holds them.
_DROPPED = ("gesture.npz", "location.npz")
_OLD_PARTS = (MANIFEST, CONTENT[0], _DROPPED[0], CONTENT[1], _DROPPED[1], GOLDEN, SUMS)

_LABEL = re.compile(r"[a-z][a-z0-9_]{0,39}")  # 40 characters fit in a packet
_LIMITS: dict[str, tuple[type, float, float]] = {  # type and range of the plain fields
    "rows": (int, 1, 30),  # 900 taxels fit in a packet of telemetry
    "columns": (int, 1, 30),
    "window": (int, 1, 250),
    "pitch_mm": (float, 0.1, 1000.0),
    "rate_hz": (float, 0.1, 1000.0),
}
_RANGES = {  # of settings; others are from 0 to 1e9, which stands for never
    "scale": (1e-9, 1e9),  # images stay finite
    "start_s": (0.0, 100.0),  # all frames of this time are kept
    "smoothing": (0.01, 1.0),
    "on": (0.0, 1.0),
    "off": (0.0, 1.0),
}
_ENDS = 200, 150  # characters of a long message: what was found, and what was expected
_Settings = TypeVar("_Settings", PreprocessSettings, DebounceSettings, PositionSpread)


class BundleError(UserError, ValueError):
    """The bundle cannot be used; the message says why, in one sentence."""


@dataclass(frozen=True, slots=True)
class Bundle:
    """A bundle that was read and found whole.

    Attributes:
        labels: The gestures, "null" first, in the order of the network's outputs.
        rows: Taxel rows of the sensor that it was trained for.
        columns: Taxel columns.
        pitch_mm: Distance of two taxels.
        rate_hz: Frames per second.
        window: Images in a window.
        preprocess: How windows are made.
        debounce: When a gesture counts.
        mapping: What each gesture asks for.
        card: Where it comes from: data, accuracy, date, as its maker wrote it.
        gesture_onnx: The network window -> probabilities.
        location_onnx: The network image -> touch; empty in a bundle that locates nothing.
        golden: Questions and answers that prove the networks on this machine.
        hash: SHA-256 of the file, hexadecimal.
        spread: How far off the places are that it tells; None: nobody measured it.
        users: Whom it knows, and what for.
        user_onnx: The network window -> who; empty in a bundle that cannot tell.
        heads: Users' own networks window -> probabilities, by name.
    """

    labels: tuple[str, ...]
    rows: int
    columns: int
    pitch_mm: float
    rate_hz: float
    window: int
    preprocess: PreprocessSettings
    debounce: DebounceSettings
    mapping: Mapping
    card: dict[str, Any]
    gesture_onnx: bytes
    location_onnx: bytes
    golden: Golden
    hash: str
    spread: PositionSpread | None = None
    users: Users = NOBODY
    user_onnx: bytes = b""
    heads: AbstractMapping[str, bytes] = field(default_factory=dict)

    @property
    def locates(self) -> bool:
        """Whether it says where a touch is."""
        return bool(self.location_onnx)

    @property
    def tells(self) -> bool:
        """Whether it says who touches."""
        return bool(self.user_onnx)


def default_path() -> Path:
    """Return where the bundle is that ships with the program."""
    models = find_spec("models")  # `importlib.resources` would import what unpacks zip files
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
    """Return the bundle that bytes are, every one of them checked.

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
        raise BundleError("is damaged: a part is not what SHA256SUMS says of it")
    return {name: data for name, data in parts.items() if name not in _DROPPED}


def content(parts: AbstractMapping[str, bytes]) -> dict[str, bytes]:
    """Return the parts that `write` takes, of those that `unpack` gives."""
    return {name: data for name, data in parts.items() if name not in (MANIFEST, SUMS)}


def manifest(text: bytes) -> dict[str, Any]:
    """Return what bundle.toml says, in the newest form.

    Raises:
        BundleError: It is no TOML, too large, or of a form that is not known.
    """
    try:
        table = parse_toml(text)
    except ConfigError as error:
        raise BundleError(f"has a manifest that cannot be used: {error}") from None
    form = table.get("format")
    if type(form) is not int or form not in READABLE:
        raise BundleError(
            f"has format {form!r}, this program reads {READABLE[0]} to {READABLE[-1]}; "
            "update the older one"
        )
    if form == 1:
        defaults = PreprocessSettings()
        added = {"normalise": defaults.normalise, "scale": defaults.scale}
        table["preprocess"] = {**added, **_table(table, "preprocess")}
    return {**table, "format": FORMAT}


def write(path: Path, *, manifest: bytes, parts: AbstractMapping[str, bytes]) -> None:
    """Write a bundle, complete or not at all; what the path held before is replaced.

    Args:
        path: Where to; `NAME.orb`.
        manifest: The text of bundle.toml, UTF-8.
        parts: The bytes of each name in `CONTENT`, and of users' networks by the names that
            `controller/recognition/users.py` gives them, as far as the manifest says so.

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
        if len(data) > MAX_BYTES:
            raise BundleError(f"has {len(data)} bytes, more than the {MAX_BYTES} allowed")
        _parse(whole, hashlib.sha256(data).hexdigest())
    except BundleError as error:
        raise BundleError(f"the bundle for {path} {error}") from None
    atomic_write(path, data)


def _content(path: Path) -> bytes:
    """Return the bytes of a regular file of reasonable size."""
    try:
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
            if size > MAX_BYTES:
                raise BundleError(f"has {size} bytes, more than the {MAX_BYTES} allowed")
            return file.read(size)  # memory for all that is asked for is taken first
    except FileNotFoundError:
        raise BundleError("does not exist; check its name") from None
    except OSError as error:
        raise BundleError(f"cannot be read: {reason(error)}; name a file NAME.orb") from None


def _cut(problem: str) -> str:
    """Return a message without its middle, where it holds a value as long as a manifest."""
    first, last = _ENDS
    if len(problem) <= first + last:
        return problem
    return f"{problem[:first]} ... {problem[-last:]}"


def _parse(parts: AbstractMapping[str, bytes], digest: str) -> Bundle:
    """Return the bundle that whole parts make, every field checked."""
    table = manifest(parts[MANIFEST])
    labels = _labels(table.get("labels"))
    plain = {name: _number(table, name) for name in _LIMITS}
    rows, columns, window = int(plain["rows"]), int(plain["columns"]), int(plain["window"])
    preprocess = _settings(PreprocessSettings, table, "preprocess")
    if (preprocess.window, preprocess.rate_hz) != (window, plain["rate_hz"]):
        raise BundleError("names one window and rate at its top and others under [preprocess]")
    try:
        mapping = parse_mapping(_table(table, "mapping"), labels)
    except MappingError as error:
        raise BundleError(f"has a [mapping] that cannot be used: {error}") from None
    located = bool(parts["location.onnx"])
    try:
        known = users.parse(table.get("users"), labels)
        _check_parts(set(content(parts)), known)
        golden = goldens.read(
            parts[GOLDEN], (window, rows, columns), len(labels), located=located, users=known,
            told=bool(parts.get(users.NETWORK)), most=MAX_BYTES,
        )  # fmt: skip
    except (UsersError, GoldenError) as error:
        raise BundleError(str(error)) from None
    if not located and not all(_everywhere(m) for m in (mapping, *known.mappings.values())):
        raise BundleError("maps gestures by their place, but has no network that tells it")
    return Bundle(
        labels=labels,
        rows=rows,
        columns=columns,
        pitch_mm=plain["pitch_mm"],
        rate_hz=plain["rate_hz"],
        window=window,
        preprocess=preprocess,
        debounce=_settings(DebounceSettings, table, "debounce"),
        spread=_settings(PositionSpread, table, "location") if "location" in table else None,
        mapping=mapping,
        card=_card(table),
        gesture_onnx=parts["gesture.onnx"],
        location_onnx=parts["location.onnx"],
        golden=golden,
        hash=digest,
        users=known,
        user_onnx=parts.get(users.NETWORK, b""),
        heads={name: parts[users.head_part(name)] for name in known.heads},
    )


def _everywhere(mapping: Mapping) -> bool:
    """Whether no rule asks where a touch is."""
    return all(rules[-1:] == rules for rules in mapping.rules.values())


def _check_parts(given: set[str], known: Users) -> None:
    """Refuse parts that nobody would look at, and the lack of others."""
    wanted = {*CONTENT, *(users.head_part(name) for name in known.heads)}
    if known.names:
        wanted.add(users.NETWORK)
    if REHEARSAL in given:
        wanted.add(REHEARSAL)
    if odd := ", ".join(sorted(wanted ^ given)):
        raise BundleError(f"has other parts than its manifest says ({odd}); write it anew")


def _in_order(names: Iterable[str]) -> tuple[str, ...]:
    """Return the parts of a file in the one order that they have there."""
    own = sorted(set(names) - set(PARTS), key=lambda name: (name != users.NETWORK, name))
    return (MANIFEST, *CONTENT, *own, SUMS)


def _labels(value: Any) -> tuple[str, ...]:
    """Return the labels, checked: names of their own, null first."""
    ok = (
        isinstance(value, list)
        and 2 <= len(value) <= 64
        and all(isinstance(label, str) and _LABEL.fullmatch(label) for label in value)
        and len(set(value)) == len(value)
        and value[0] == "null"
    )
    if not ok:
        raise BundleError(
            f"has the labels {value!r}; expected are 2 to 64 different names in small letters, "
            '"null" first'
        )
    return tuple(value)


def _number(table: dict[str, Any], name: str) -> float:
    """Return a plain number of the manifest, of its type and within its range."""
    kind, low, high = _LIMITS[name]
    value = table.get(name)
    accepted = int if kind is int else (int, float)
    if isinstance(value, bool) or not isinstance(value, accepted) or not low <= value <= high:
        noun = "a whole number" if kind is int else "a number"
        raise BundleError(f"has {name} = {value!r}; expected is {noun} from {low:g} to {high:g}")
    return kind(value)  # type: ignore[no-any-return]


def _table(table: dict[str, Any], name: str) -> dict[str, Any]:
    value = table.get(name)
    if not isinstance(value, dict):
        raise BundleError(f"has no table [{name}] in its manifest")
    return value


def _card(table: dict[str, Any]) -> dict[str, Any]:
    """Return the card; all of it is its maker's, but for the notes of lessons."""
    card = _table(table, "card")
    if not isinstance(card.get("added", []), list):
        raise BundleError(f"has added = {card['added']!r} under [card]; expected is a list")
    return card


def _settings(kind: type[_Settings], table: dict[str, Any], name: str) -> _Settings:
    """Return the settings in a table: exactly the fields of the dataclass, all finite numbers."""
    values = _table(table, name)
    fields = {field.name: field.type for field in dataclasses.fields(kind)}
    if set(values) != set(fields):
        odd = ", ".join(sorted(set(values) ^ set(fields)))
        raise BundleError(f"has a [{name}] of another version of this program ({odd}); update one")
    checked: dict[str, Any] = {}
    for key, value in values.items():
        wanted = fields[key]
        if wanted is float and type(value) is int:
            value = float(value)
        low, high = _RANGES.get(key, (0.0, 1e9))
        if type(value) is not wanted or (wanted is not str and not low <= value <= high):
            noun = "a text" if wanted is str else f"a number from {low:g} to {high:g}"
            raise BundleError(f"has {key} = {value!r} under [{name}]; expected is {noun}")
        checked[key] = value
    try:
        return kind(**checked)
    except ValueError as error:
        raise BundleError(f"has under [{name}] {error}") from None
