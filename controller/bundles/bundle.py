"""Deployable bundles: one file `NAME.orb` with networks, labels, settings and golden vectors.

An embedding network and a head (`head`) make probabilities of a window. A bundle with enrolled
users (`users_table`) may also have the user network. The form of the file is `container`'s.
"""

import hashlib
from collections.abc import Mapping as AbstractMapping
from dataclasses import dataclass, field, fields, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.bundles import container, users_table, vocabulary
from controller.bundles import head as heads
from controller.bundles.container import (
    CONTACT,
    CONTENT,
    EMBEDDING,
    GOLDEN,
    HEAD,
    LOCATION,
    MANIFEST,
    MAX_BYTES,
    REHEARSAL,
    STATE,
    TAUGHT,
    USER,
    BundleError,
    arrays_of,
    check_arrays,
)
from controller.bundles.head import EVERYBODY, Head
from controller.recognition.contact import OUTPUTS, PICTURES, SCALARS, VALUES, ContactNetwork
from controller.recognition.contact_radius import ContactSettings, RadiusNetwork
from controller.recognition.debounce import DebounceSettings
from controller.recognition.images.frames import MOST_WINDOW, PreprocessSettings, same_rate
from controller.recognition.mapping import Mapping, MappingError
from controller.recognition.mapping import parse as parse_mapping
from controller.recognition.pipeline import PipelineSettings
from controller.recognition.touch_input import TouchInput
from controller.recognition.touch_position import PositionSpread
from controller.recognition.user_id import NO_USERS, Users
from controller.shared import config, npz
from controller.shared.config import ConfigError
from controller.shared.errors import one_line, reason
from controller.shared.files import atomic_write, read_bytes
from controller.shared.touch_strength import LEAST, MOST

USUAL, SLOW = "orbtouch.orb", "orbtouch-10hz.orb"  # those that ship, in the package `models`
SLOW_HZ = 10.0  # of the second, for the paper's rate and slow devices
_OTHERS = ("format", "mapping", "users")  # entries of a manifest with their own parsers
LABEL = r"[a-z][a-z0-9_]{0,39}"  # 40 characters fit in a packet
_GOLDEN = 1e-2  # greatest difference from a golden output, in deviations
_ENDS = 200, 150  # characters kept of the beginning and the end of a long message
_USER_OUTPUT = "people"  # output of the user network

Answers = NDArray[np.float32]  # (n, outputs)


@dataclass(frozen=True, slots=True, kw_only=True)
class BundleSettings:
    """The scalar settings in bundle.toml."""

    labels: tuple[str, ...] = field(
        metadata={
            "pattern": LABEL,
            "count": (2, 64),
            "expected": '2 to 64 different names in small letters, "null" first',
        }
    )
    rows: int = field(metadata={"range": (1, 30)})  # 900 taxels fit in a packet of telemetry
    columns: int = field(metadata={"range": (1, 30)})
    pitch_mm: float = field(metadata={"range": (0.1, 1000.0)})  # distance between adjacent taxels
    rate_hz: float = field(metadata={"range": (0.1, 1000.0)})
    window: int = field(metadata={"range": (1, MOST_WINDOW)})  # images in a window
    preprocess: PreprocessSettings
    debounce: DebounceSettings
    card: dict[str, Any]  # origin of the model: data, accuracy, date
    # standard deviation of touch positions; None if it was not measured
    spread: PositionSpread | None = field(default=None, metadata={"key": "location"})
    touch: TouchInput = field(default_factory=TouchInput)  # input of the location network
    # gestures that a wide contact cannot be
    contact: ContactSettings = field(default_factory=ContactSettings)
    # touch strength of users without one of their own: `controller.shared.touch_strength`
    strength: float = field(default=1.0, metadata={"range": (LEAST, MOST)})


def _no_answers() -> Answers:
    return np.zeros((0, 0), dtype=np.float32)


@dataclass(frozen=True, slots=True)
class Golden:
    """Reference inputs and outputs of the networks, against which a device compares its own."""

    # inputs of the gesture and user networks, (n, window, rows, columns), z
    windows: NDArray[np.float32]
    probabilities: Answers  # outputs of embedding and head as trained, (n, classes)
    images: NDArray[np.float32]  # inputs of the location network, (m, rows, columns), z
    touches: Answers  # its outputs, (m, 2), x and y in grid units
    # outputs of the user network, (n, 1 + users); n is 0 without that network
    people: Answers = field(default_factory=_no_answers)

    def pack(self) -> bytes:
        """Return the file `golden.npz`."""
        names = ["windows", "probabilities", "images", "touches"]
        names += [_USER_OUTPUT] if len(self.people) else []
        return npz.pack({name: getattr(self, name) for name in names})


@dataclass(frozen=True, slots=True, kw_only=True)
class Bundle(BundleSettings):
    """A bundle that was read and checked."""

    mapping: Mapping
    embedding_onnx: bytes  # the network window -> embedding
    head: Head  # embedding -> probabilities, as it was trained
    location_onnx: bytes  # the network image -> touch; empty in a bundle without positions
    golden: Golden
    hash: str  # SHA-256 of the file, hexadecimal
    users: Users = NO_USERS
    # the network window -> user; empty in a bundle that cannot identify users
    user_onnx: bytes = b""
    # how wide a contact is; None in a bundle that cannot tell
    radius: RadiusNetwork | None = None
    # what touches in each frame; None in a bundle that cannot tell
    contacts: ContactNetwork | None = None
    # taught rows of the head by user; those for all users under `EVERYBODY`
    taught: AbstractMapping[str, Head] = field(default_factory=dict)

    def head_of(self, user: str = EVERYBODY) -> Head:
        """Return the head with the rows of a user, or those for all users if there are none."""
        rows = self.taught.get(user, self.taught.get(EVERYBODY))
        return self.head if rows is None else self.head.extended(rows)

    def strength_of(self, user: str = EVERYBODY) -> float:
        """Return the touch strength of a user, or that for all users if they have none."""
        return self.users.strengths.get(user, self.strength)

    @property
    def settings(self) -> PipelineSettings:
        """Settings of the pipeline's stages."""
        return PipelineSettings(
            self.labels,
            self.rows,
            self.columns,
            self.preprocess,
            self.debounce,
            self.spread,
            self.users,
            self.identifies,
            self.strength,
            self.contact,
            self.radius,
            self.contacts,
        )

    @property
    def locates(self) -> bool:
        """Whether it has positions of touches."""
        return bool(self.location_onnx)

    @property
    def identifies(self) -> bool:
        """Whether it identifies users."""
        return bool(self.user_onnx)


def default_path(rate_hz: float | None = None) -> Path:
    """Return the path of the shipped bundle for so many frames per second.

    It is the usual one, which is for 40 Hz, if no rate is given or none ships for it.
    """
    models = find_spec("models")  # located without an import: it is another package
    assert models is not None
    assert models.origin is not None
    slow = rate_hz is not None and same_rate(rate_hz, SLOW_HZ)
    return Path(models.origin).with_name(SLOW if slow else USUAL)


def read(path: Path) -> Bundle:
    """Return the bundle in a file, every byte checked; BundleError if it cannot be used."""
    try:
        return parse(read_bytes(path, MAX_BYTES))
    except FileNotFoundError:
        problem = "does not exist; check its name"
    except OSError as error:
        problem = f"cannot be read: {reason(error)}; name a file NAME.orb"
    except BundleError as error:
        problem = _cut(one_line(str(error)))
    raise BundleError(f"the bundle {path} {problem}")


def parse(data: bytes) -> Bundle:
    """Return the bundle in a file's bytes; BundleError, without a subject, if it cannot be used."""
    return _parse(container.unpack(data), hashlib.sha256(data).hexdigest())


def write(path: Path, *, manifest: bytes, parts: AbstractMapping[str, bytes]) -> None:
    """Write a bundle of bundle.toml's text and the parts it names atomically; an older one goes.

    Raises:
        BundleError: `read` would refuse the result.
        OSError: The file cannot be written.
    """
    try:
        data = assembled(manifest, parts)
    except BundleError as error:
        raise BundleError(f"the bundle for {path} {error}") from None
    atomic_write(path, data)


def assembled(manifest: bytes, parts: AbstractMapping[str, bytes]) -> bytes:
    """Return the file of a bundle; BundleError, without a subject, if `parse` would refuse it."""
    complete = container.complete(manifest, parts)
    data = container.pack(complete)
    if len(data) > MAX_BYTES:
        raise BundleError(f"has {len(data)} bytes, more than the {MAX_BYTES} allowed")
    _parse(complete, hashlib.sha256(data).hexdigest())
    return data


def _cut(problem: str) -> str:
    """Return a message without its middle if it is long: it may quote a whole manifest."""
    first, last = _ENDS
    if len(problem) <= first + last:
        return problem
    return f"{problem[:first]} ... {problem[-last:]}"


def _parse(parts: AbstractMapping[str, bytes], digest: str) -> Bundle:
    """Return the bundle in checked parts, with every field checked."""
    table = container.manifest(parts[MANIFEST])
    located, identified = bool(parts[LOCATION]), bool(parts.get(USER))
    try:
        plain = _settings(table)
        when = plain.debounce
        timed = (*when.patient, *when.awaited, *when.slow, *when.brisk)
        named = (*timed, *plain.contact.labels, *plain.contact.several)
        if odd := [label for label in named if label not in plain.labels[1:]]:
            raise BundleError(f"has a setting of a gesture {odd[0]!r} that it does not have")
        if not isinstance(rules := table.get("mapping"), dict):
            raise BundleError("has no table [mapping] in its manifest")
        mapping = parse_mapping(rules, plain.labels)
        known = users_table.parse(table.get("users"), plain.labels)
        _check_parts(set(container.content(parts)), known)
        head = heads.read(parts[HEAD])
        taught = heads.read_rows(parts[TAUGHT]) if TAUGHT in parts else {}
        _check_head(head, taught, plain.labels, known)
        golden = _read_golden(
            parts[GOLDEN],
            (plain.window, plain.rows, plain.columns),
            len(head.out),
            located=located,
            people=1 + len(known.names) if identified else 0,
        )
    except MappingError as error:
        raise BundleError(f"has a [mapping] that cannot be used: {error}") from None
    except ConfigError as error:
        raise BundleError(str(error)) from None
    tables = [mapping.rules, *(own.rules for own in known.mappings.values())]
    if not located and any(rules[1:] for table in tables for rules in table.values()):
        raise BundleError("maps gestures by their place, but has no location network")
    return Bundle(
        **{entry.name: getattr(plain, entry.name) for entry in fields(plain)},
        mapping=mapping,
        embedding_onnx=parts[EMBEDDING],
        head=head,
        location_onnx=parts[LOCATION],
        golden=golden,
        hash=digest,
        users=known,
        user_onnx=parts.get(USER, b""),
        radius=_read_radius(parts[CONTACT], plain) if CONTACT in parts else None,
        contacts=_read_contacts(parts[STATE], plain) if STATE in parts else None,
        taught=taught,
    )


def _read_golden(
    data: bytes,
    grid: tuple[int, int, int],
    classes: int,
    *,
    located: bool,
    people: int,
) -> Golden:
    """Return the golden vectors in a file for windows of a grid (window, rows, columns).

    `people` is the number of outputs of the user network; 0: there is none. BundleError if the file
    is damaged, or its arrays have other shapes.
    """
    arrays = arrays_of(data, "golden vectors")
    shapes: dict[str, tuple[int, ...]] = {
        "windows": grid,
        "probabilities": (classes,),
        "images": grid[1:],
        "touches": (2,),
    }
    if people:
        shapes[_USER_OUTPUT] = (people,)
    check_arrays("golden vectors", arrays, {name: (-1, *shape) for name, shape in shapes.items()})
    windows, images = len(arrays["windows"]), len(arrays["images"])
    answers = [len(arrays[name]) for name in ("probabilities", _USER_OUTPUT) if name in arrays]
    same = {windows} == set(answers) and images == len(arrays["touches"])
    if not same or not windows or bool(images) != located:
        raise BundleError("has different numbers of golden inputs and outputs")
    return Golden(**arrays)


def _read_radius(data: bytes, plain: BundleSettings) -> RadiusNetwork:
    """Return the network in a part; BundleError if it is damaged, or for another sensor."""
    arrays = arrays_of(data, "a network of contacts")
    units = len(arrays.get("first_bias", ()))
    shapes = {"first": (units, 2 * plain.rows * plain.columns + 2), "first_bias": (units,)}
    shapes |= {"second": (units, units), "second_bias": (units,), "out": (2, units)}
    check_arrays("a network of contacts", arrays, {**shapes, "out_bias": (2,), "prior": (2,)})
    return RadiusNetwork(**arrays)


def _read_contacts(data: bytes, plain: BundleSettings) -> ContactNetwork:
    """Return the network in a part, checked by its golden vectors; BundleError if it is damaged."""
    what = "a network of what touches"
    arrays = arrays_of(data, what)
    short = {name for name, array in arrays.items() if array.dtype == np.float16}
    arrays |= {name: arrays[name].astype(np.float32) for name in short}
    units, wide = len(arrays.get("first_bias", ())), PICTURES * plain.rows * plain.columns + SCALARS
    shapes: dict[str, tuple[int, ...]] = {"first": (units, wide), "first_bias": (units,)}
    for name in ("gates", "memory"):
        shapes |= {name: (3 * units, units), f"{name}_bias": (3 * units,)}
    said = vocabulary.shipped().labels  # or nothing
    outs = OUTPUTS + len(said) * (len(arrays.get("out_bias", ())) > OUTPUTS)
    shapes |= {"out": (outs, 2 * units), "out_bias": (outs,), "scale": (2, VALUES)}
    golden = {"golden_inputs": (-1, wide), "golden_outputs": (-1, outs)}
    check_arrays(what, arrays, {**shapes, **golden})
    given, expected = (arrays.pop(name) for name in golden)
    network = ContactNetwork(**arrays)
    if not len(given) or len(given) != len(expected):
        raise BundleError(f"has {what} with other numbers of golden inputs and outputs")
    if not np.allclose(network.outputs(given), expected, atol=_GOLDEN):
        raise BundleError(f"has {what} that does not give its golden outputs")
    if plain.labels[: len(said)] != said:  # it does not know these gestures
        network = replace(network, out=network.out[:OUTPUTS], out_bias=network.out_bias[:OUTPUTS])
    return network


def _settings(table: dict[str, Any]) -> BundleSettings:
    """Return the scalar settings of a manifest; BundleError or ConfigError if one is wrong."""
    own = {key: value for key, value in table.items() if key not in _OTHERS}
    plain = config.settings(BundleSettings, own)
    if plain.labels[0] != "null":
        raise BundleError(f'has the labels {", ".join(plain.labels)}; expected is "null" first')
    if (plain.preprocess.window, plain.preprocess.rate_hz) != (plain.window, plain.rate_hz):
        raise BundleError("names one window and rate at its top and others under [preprocess]")
    added = plain.card.get("added", [])  # notes of later training; the rest of the card is free
    if not isinstance(added, list):
        raise BundleError(f"has added = {added!r} under [card]; expected is a list")
    return plain


def _check_parts(given: set[str], known: Users) -> None:
    """Refuse parts that no bundle has, missing ones, and a user network of no users."""
    optional = {CONTACT, STATE, REHEARSAL, TAUGHT, *([USER] if known.names else [])}
    if odd := ", ".join(sorted((given ^ set(CONTENT)) - optional)):
        raise BundleError(f"has other parts than its manifest names ({odd}); write it again")


def _check_head(
    head: Head, taught: AbstractMapping[str, Head], labels: tuple[str, ...], known: Users
) -> None:
    """Refuse rows of unknown users, and a head with other classes than the labels."""
    if odd := sorted(set(taught) - {EVERYBODY, *known.names}):
        raise BundleError(f"has rows of {odd[0]!r} in its head, who is none of its users")
    width, trained = head.hidden.shape[1], len(head.out)
    for own in taught.values():
        if (own.hidden.shape[1], len(own.out)) != (width, len(labels)):
            raise BundleError("has rows in its head for another embedding, or for other labels")
    if trained > len(labels) or (trained < len(labels) and EVERYBODY not in taught):
        raise BundleError(f"has {len(labels)} labels, and a head that knows {trained}")
