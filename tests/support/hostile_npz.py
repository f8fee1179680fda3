"""Recordings as an enemy would write them: every name below is a lie, and the sentence it earns."""

import bz2
import io
import json
import lzma
import os
import struct
import zipfile
import zlib
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from controller.recordings import reader, recording, writer
from controller.shared import npz

ORIGIN: Final = recording.Provenance("d", 5, 5, 10.0, 10.0, ("null", "press"), "", "", "0")
COUNT: Final = 30
DEFLATE64: Final = 9


class Trap:
    """Unpickled, it would leave a folder behind."""

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[str]]:
        return os.mkdir, ("sprung",)


def healthy() -> npz.Arrays:
    """The arrays of a recording with nothing wrong."""
    unsaid = recording.unlabelled(COUNT)
    whole = recording.Recording(
        ORIGIN,
        np.full((COUNT, 5, 5), 40.0, dtype=np.float32),
        t=np.arange(COUNT) / 10,
        sequence=np.arange(COUNT, dtype=np.int64),
        label=unsaid["label"],
        button=unsaid["button"],
        key=unsaid["key"],
        cue=unsaid["cue"],
        excluded=np.zeros(COUNT, dtype=np.bool_),
        touch=np.full((COUNT, 2), np.nan),
        marks=(recording.Mark(0.5, "cue", "go"),),
    )
    return npz.unpack(writer.pack(whole), reader.MAX_BYTES)


def but(**arrays: Any) -> bytes:
    """A healthy recording but for some arrays."""
    return npz.pack({**healthy(), **arrays})


def says(**fields: Any) -> bytes:
    """A healthy recording that says something else of its origin."""
    told = {**json.loads(recording.format_provenance(ORIGIN)), **fields}
    return but(meta=np.array(json.dumps(told)))


def npy(shape: str, descr: str = "'<f4'", data: bytes = b"", version: int = 1) -> bytes:
    """An array whose header has this text for its shape and its type."""
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}"
    return headed(text.encode("latin-1"), data, version)


def headed(text: bytes, data: bytes = b"", version: int = 1, length: int | None = None) -> bytes:
    """An array with this header, which claims to have some length."""
    size = len(text) if length is None else length
    return (
        b"\x93NUMPY" + bytes([version, 0]) + size.to_bytes(2 if version == 1 else 4, "little")
    ) + text + data  # fmt: skip


def member(
    name: bytes = b"frames.npy",
    data: bytes = b"",
    packed: bytes | None = None,
    *,
    method: int = zipfile.ZIP_STORED,
    flags: int = 0,
    size: int | None = None,
    extra: bytes = b"",
) -> tuple[bytes, bytes, bytes]:
    """A member's local record, its directory entry up to the offset, and the entry's rest."""
    body = data if packed is None else packed
    length = len(data) if size is None else size
    fields = (20, flags, method, 0, 0x21, zlib.crc32(data), len(body), length, len(name))
    local = struct.pack("<4s5H3L2H", b"PK\3\4", *fields, 0) + name + body
    entry = struct.pack("<4s6H3L5HL", b"PK\1\2", 20, *fields, len(extra), 0, 0, 0, 0)
    return local, entry, name + extra


def archive(*members: tuple[bytes, bytes, bytes], together: bool = False) -> bytes:
    """A zip file of these members; together: all entries mean the first one's bytes."""
    body, directory = bytearray(), bytearray()
    for local, entry, rest in members:
        directory += entry + struct.pack("<L", 0 if together else len(body)) + rest
        body += b"" if together and body else local
    count = min(len(members), 0xFFFF)
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, count, count, len(directory), len(body), 0)
    return bytes(body + directory + end)


def deflated(data: bytes) -> bytes:
    """What stands in a zip file for this."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    return packer.compress(data) + packer.flush()


def zeros(shape: tuple[int, ...]) -> bytes:
    """A file with as many frames as there may be, all there, and nothing else but meta."""
    header = npy(repr(shape))
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as out:
        out.writestr("meta.npy", npz_member("meta", np.array(recording.format_provenance(ORIGIN))))
        with out.open("frames.npy", "w", force_zip64=True) as stream:
            stream.write(header)
            left = int(np.prod(shape)) * 4
            while left:
                stream.write(bytes(min(left, 8 << 20)))
                left -= min(left, 8 << 20)
    return buffer.getvalue()


def npz_member(name: str, array: Any) -> bytes:
    """An array as the bytes of a member."""
    with zipfile.ZipFile(io.BytesIO(npz.pack({name: array}))) as packed:
        return packed.read(f"{name}.npy")


def pickled(array: Any) -> bytes:
    """What `numpy.savez` makes of it."""
    buffer = io.BytesIO()
    np.savez(buffer, frames=array)
    return buffer.getvalue()


def one(data: bytes) -> bytes:
    """A zip file with `frames` of these bytes."""
    return archive(member(data=data))


BLANK: Final = npy("(25,)", data=bytes(100))
LARGE: Final = bytes(64 << 20)
EXTRA: Final = bytes(4) * 16_000  # 16 000 fields of no length
HUGE: Final = struct.pack("<HHQ", 1, 8, 1 << 63)
NESTED: Final = [("a", [("b", object)])]

# Each file by what it tries, and the refusal that it shall meet.
FILES: Final[dict[str, tuple[Callable[[], bytes], str]]] = {
    # Pickles.
    "an object": (lambda: pickled(np.array([Trap()], dtype=object)), "pickled objects in 'fr"),
    "a record of objects": (lambda: pickled(np.array([(Trap(),)], dtype=[("a", object)])), "plain"),
    "a record in a record": (lambda: pickled(np.array([((Trap(),),)], dtype=NESTED)), "no plain"),
    "an object by its letter": (lambda: one(npy("(1,)", "'O'", b"cos\nsystem\n.")), "pickled"),
    "objects in rows": (lambda: one(npy("(1,)", "'(2,)O'", b"cos\nsystem\n.")), "no plain array"),
    "a pickle for a file": (lambda: b"\x80\x04cos\nmkdir\nX\x06\x00\x00\x00sprungR.", "not a wh"),
    # Bombs.
    "all that is allowed, and more": (lambda: zeros((5_368_710, 5, 5)), "unpacks to"),
    "a size that is too small": (
        lambda: archive(member(data=BLANK, packed=deflated(BLANK + LARGE), method=8)),
        "is no recording",
    ),
    "a size that is too large": (
        lambda: archive(
            member(data=npy("(100000000,)"), packed=deflated(BLANK), method=8, size=400_000_080)
        ),
        "fewer bytes than it claims",
    ),
    "a size beyond the file": (
        lambda: archive((member(data=BLANK)[0][:-50], *member(data=BLANK)[1:])),
        "longer than the file",
    ),
    "a size of 64 bits": (lambda: archive(member(size=0xFFFFFFFF, extra=HUGE)), "unpacks to"),
    "one member for all": (
        lambda: archive(*[member(b"a%d.npy" % k, BLANK) for k in range(200)], together=True),
        "share their bytes",
    ),
    "members in a member": (
        lambda: archive(member(data=BLANK * 3), member(b"t.npy", BLANK), together=True),
        "share their bytes",
    ),
    "many members": (
        lambda: archive(*[member(b"a%d.npy" % k, BLANK) for k in range(300)]),
        "300 members, more than",
    ),
    "a directory larger than the rest": (
        lambda: archive(*[member(b"a.npy")] * 300_000, together=True),
        "zip directory",
    ),
    "fields without end": (lambda: archive(member(data=BLANK, extra=EXTRA)), "no recording"),
    "bzip2": (lambda: archive(member(data=LARGE, packed=bz2.compress(LARGE), method=12)), "deflat"),
    "lzma": (
        lambda: archive(member(data=LARGE, packed=lzma.compress(LARGE, preset=0), method=14)),
        "another method than deflate",
    ),
    "deflate64": (lambda: archive(member(data=BLANK, method=DEFLATE64)), "another method"),
    "no method at all": (lambda: archive(member(data=BLANK, method=99)), "another method"),
    "a password": (lambda: archive(member(data=BLANK, flags=1)), "encrypted"),
    "a patch": (lambda: archive(member(data=BLANK, flags=0x20)), "encrypted"),
    "strong encryption": (lambda: archive(member(data=BLANK, flags=0x41)), "encrypted"),
    # Shapes.
    "less than nothing": (lambda: one(npy("(-1, 5, 5)")), "no plain array"),
    "no dimension": (lambda: but(frames=np.float32(1)), r"not float32 \(n, 5, 5\)|no frames of"),
    "a product that overflows": (lambda: one(npy("(4294967296, 4294967296, 4)")), "not fit"),
    "nothing, in rows without end": (lambda: one(npy("(0, 9223372036854775807)")), "not fit"),
    "a size of a thousand digits": (lambda: one(npy(f"({'9' * 1000},)")), "not fit its shape"),
    "33 dimensions": (lambda: one(npy("(1" + ", 1" * 32 + ")", data=bytes(4))), "33 dimensions"),
    "texts of no letter": (lambda: one(npy("(1000000000,)", "'<U0'")), "no plain array"),
    "texts of a billion letters": (lambda: one(npy("(0,)", "'<U900000000'")), "not"),
    "a type that is none": (lambda: one(npy("(1,)", "'<f3'", bytes(3))), "not a whole"),
    "dates": (lambda: one(npy("(1,)", "'<M8[ns]'", bytes(8))), "no plain array"),
    # Headers.
    "a header of 4 GiB": (lambda: one(headed(b"", version=2, length=0xFFFFFFFF)), "header of 4294"),
    "a header of a book": (lambda: one(headed(b" " * (1 << 20), version=2)), "header of 1048576"),
    "brackets in brackets": (lambda: one(headed(b"(" * 4000)), "no plain array"),
    "signs in a row": (lambda: one(headed(b"{'shape': " + b"-" * 4000 + b"1}")), "no plain array"),
    "a sum for a shape": (lambda: one(npy("(" + "1+" * 1000 + "1,)")), "no plain array"),
    "a product for a shape": (lambda: one(npy("(9**9**9,)")), "no plain array"),
    "Python 2": (lambda: one(npy("(25L,)", data=bytes(100))), "no plain array"),
    "a letter beyond ASCII": (lambda: one(npy("(²,)", version=3)), "no plain array"),
    "an escape that is none": (lambda: one(npy("(1,)", r"'\d'")), "no plain array"),
    "another version": (lambda: one(headed(b"{}", version=9)), "not a whole"),
    "no header": (lambda: one(b"\x93NUMPY"), "not a whole"),
    # Names.
    "up and out": (lambda: archive(member(b"../frames.npy", BLANK)), "plain names belong"),
    "from the root": (lambda: archive(member(b"/etc/frames.npy", BLANK)), "plain names belong"),
    "from drive C": (lambda: archive(member(b"C:\\frames.npy", BLANK)), "plain names belong"),
    "a name of nothing": (lambda: archive(member(b".npy", BLANK)), "plain names belong"),
    "no name": (lambda: archive(member(b"", BLANK)), "plain names belong"),
    "a zero in a name": (lambda: archive(member(b"frames.npy\0.exe", BLANK)), "plain names"),
    "a name of 60000 letters": (lambda: archive(member(b"a" * 60_000, BLANK)), "plain names"),
    "a name that clears the screen": (lambda: archive(member(b"\x1b[2J.npy", BLANK)), "x1b"),
    "one name twice": (lambda: archive(*[member(data=BLANK)] * 2), "two members of one name"),
    # What it says of itself.
    "lists in lists": (lambda: but(meta=np.array("[" * 100_000)), "nothing legible"),
    "a number of 5000 digits": (lambda: but(meta=np.array("9" * 5000)), "nothing legible"),
    "rows of 4000 digits": (lambda: says(rows=10**4000), "impossible things"),
    "a rate that is no number": (lambda: says(rate_hz=float("nan")), "impossible things"),
    "a rate without end": (lambda: says(rate_hz=float("inf")), "impossible things"),
    "half a letter": (lambda: says(user="\ud800"), "impossible things"),
    "a label that clears the screen": (lambda: says(labels=["null", "\x1b[2J"]), "impossible"),
    "labels in one word": (lambda: says(labels="np"), "nothing legible"),
    "a form that is true": (lambda: says(schema=True), "has form True, this program reads"),
    "a form of a thousand forms": (lambda: says(schema=[1] * 1000), "has form .{20}, this"),
    "a million lists": (lambda: but(meta=np.array("[]," * 1_000_000)), "holds too much"),
    "letters beyond all letters": (
        lambda: but(meta=np.frombuffer(b"\xff" * 400, "<U100")[0:1].reshape(())),
        "texts that are none",
    ),
    # Tables and columns.
    "ten million marks": (
        lambda: but(mark_t=np.zeros(10**7), mark_kind=np.zeros(10**7, "<U1")),
        "10000000 rows",
    ),
    "half letters in a mark": (lambda: but(mark_text=np.array(["\udc00"])), "texts that are none"),
    "numbers that wrap around": (
        lambda: but(sequence=np.r_[np.arange(29), np.iinfo(np.int64).min]),
        "'sequence' that does not rise",
    ),
    "times at the end of time": (lambda: but(t=np.r_[-1.7e308, np.arange(28), 1.7e308]), "beyond"),
    "the other end first": (lambda: but(frames=healthy()["frames"].astype(">f4")), ">f4|no frames"),
}  # fmt: skip
