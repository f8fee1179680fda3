"""Manifests and records that strangers may have written, from a seed, and such bundles."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random
from typing import Final

import numpy as np

from controller.bundles import container
from controller.bundles.head import Head
from controller.shared import npz
from tests.support import user_bundles as enrolled

VALUES: Final = (
    "0", "-1", "1", "5", "0.5", "-0.0", "1e308", "1e400", "5e-324", "nan", "inf", "-inf", "true",
    "9" * 18, "9" * 400, "9" * 5000, "0x" + "f" * 400, "0b" + "1" * 200, "-" + "9" * 19,
    '""', '"null"', '"press"', f'"{"a" * 60_000}"', f'"{"漢" * 100}"', '"\\u001b]0;title\\u0007"',
    '"\\u202e"', '"\\ud800"', '"\\n\\n"', '"a\\u0000b"', "'''\nraw\n'''", '"no end', "'", '"""',
    "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "[]", "[[]]", "[1, 2]", '["press", "press"]',
    '["null", "press"]', "[" * 15 + "]" * 15, "[" * 5000, "{}", "{ a = 1 }", "{ a.b.c = 1 }",
    "{ command = 7 }", '[{ command = "down" }]', '[{ command = "down", below = nan }]',
    "[" + "1, " * 9000 + "1]", "[" + '"a", ' * 9000 + "]", "{" + "a={" * 14 + "}" * 15, "=", "",
)  # fmt: skip
LINES: Final = (
    "[card]", "[mapping]", "[users]", "[preprocess]", "[[card]]", "[[users]]", "[a]", "[users.bob]",
    "x" + ".a" * 14 + " = 1", "x" + ".a" * 9000 + " = 1", '"\\u001b[2J" = 1', '"" = ""', "a.b = 1",
    "card.added = 7", "mapping.press = 1", "users.names = 1", "# \u202e", "\ufeff", "\0", "]",
    "[" + "a." * 9000 + "a]", '"' + "k" * 60_000 + '" = 1', "added = [7]", "a = 1\na = 2",
    "[[users.mapping.bob.press]]", "[users.mapping.carl]", "\x1b[31m", "é = 1", "= 1",
)  # fmt: skip
# A manifest that is right, with people.
TEXT: Final = enrolled.manifest().decode()


def changed(text: str, draw: Random) -> bytes:
    """Return a text of TOML after one to four changes."""
    lines = text.split("\n")
    for _ in range(draw.randint(1, 4)):
        at = draw.randrange(len(lines))
        key, equals, _ = lines[at].partition("=")
        kind = draw.randrange(8)
        if kind < 4:  # most of all another value
            lines[at] = f"{key}= {draw.choice(VALUES)}" if equals else draw.choice(LINES)
        elif kind == 4:
            lines.insert(at, draw.choice(LINES))
        elif kind == 5:
            lines.insert(at, draw.choice(lines))
        elif kind == 6 and len(lines) > 1:
            del lines[at]
        else:
            lines[at] = draw.choice(("a", "ann", "press", "on", "window")) + equals + lines[at][3:]
    data = "\n".join(lines).encode(errors="replace")
    if not draw.randrange(20):
        at = draw.randrange(len(data) + 1)
        data = data[:at] + draw.randbytes(draw.randrange(4)) + data[at + 1 :]
    return data[: draw.randrange(len(data) + 1)] if not draw.randrange(40) else data


def manifests(count: int, seed: int) -> Iterator[bytes]:
    """Yield so many manifests, most of them wrong, of a bundle with people."""
    draw = Random(seed)
    for _ in range(count):
        yield changed(TEXT, draw)


def parts() -> dict[str, bytes]:
    """The parts beside such a manifest, as small as can be."""
    one = {"windows": (10, 5, 5), "probabilities": (5,), "images": (5, 5), "touches": (2,)}
    golden = {name: np.zeros((1, *shape), np.float32) for name, shape in one.items()}
    golden["people"] = np.zeros((1, 3), np.float32)
    head = Head(*(np.zeros(shape, np.float32) for shape in ((1, 1), 1, (5, 1), 5)))
    networks = {container.EMBEDDING: b"1", container.LOCATION: b"2", "user.onnx": b"3"}
    return networks | {container.GOLDEN: npz.pack(golden), container.HEAD: npz.pack(head.arrays())}


def packed(manifest: bytes, content: dict[str, bytes]) -> bytes:
    """Return the bundle's file that these make, whatever the manifest says."""
    given = {container.MANIFEST: manifest, container.SUMS: b"", **content}
    whole = {name: given[name] for name in container._in_order(given)}
    whole[container.SUMS] = container._sums(whole)
    return container.pack(whole)
