"""Version of a result: every machine of a sweep must run the same program."""

import hashlib
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Final

from controller.recordings.recording import software

# What only shows results, and what runs on the device alone: no training hangs on it.
ASIDE: Final = {
    "controller": frozenset({"cli", "links", "sensors", "teach", "runtime", "diagnostics"}),
    "models": frozenset({"cli", "reports", "studies"}),
}
TRAINING: Final = (
    "people.py",
    "perform.py",
    "recipes.py",
    "tasks.py",
    "training.py",
)  # of this folder
SUFFIXES: Final = (".py", ".toml")
PACKAGES: Final = ("numpy", "torch")


@cache
def own() -> dict[str, str]:
    """Return the versions that results hang on: ours, a hash of our sources, NumPy, PyTorch."""
    return {
        "orbtouch": software(),
        "sources": _sources(),
        **{package: _version(package) for package in PACKAGES},
    }


def differences(ours: Mapping[str, str], theirs: Mapping[str, str]) -> str:
    """Return how another machine's program differs, in words; "": it does not."""
    odd = [
        f"{what} {theirs.get(what, 'missing')} instead of {ours[what]}"
        for what in ours
        if theirs.get(what) != ours[what]
    ]
    return ", ".join(odd)


def _version(package: str) -> str:
    """Return a package's version, without what says which processor it was built for."""
    try:
        return version(package).partition("+")[0]
    except PackageNotFoundError:
        return "missing"


def _sources() -> str:
    """Return a hash of all that a training is made of."""
    digest = hashlib.sha256()
    for package, aside in ASIDE.items():
        for path, file in sorted(_files(files(package), aside), key=lambda one: one[0]):
            # Line ends differ between systems, and mean nothing.
            text = file.read_bytes().replace(b"\r\n", b"\n")
            digest.update(f"{package}{path}:{len(text)}:".encode() + text)
    for name in TRAINING:
        text = files("models.studies.sweep").joinpath(name).read_bytes().replace(b"\r\n", b"\n")
        digest.update(f"{name}:{len(text)}:".encode() + text)
    return digest.hexdigest()[:12]


def _files(
    folder: Traversable, aside: frozenset[str] = frozenset(), before: str = ""
) -> list[tuple[str, Traversable]]:
    found: list[tuple[str, Traversable]] = []
    for entry in folder.iterdir():
        path = f"{before}/{entry.name}"
        if entry.is_dir():
            if entry.name not in aside and not entry.name.startswith((".", "__")):
                found += _files(entry, before=path)
        elif entry.name.endswith(SUFFIXES) and not entry.name.startswith("."):
            found.append((path, entry))
    return found
