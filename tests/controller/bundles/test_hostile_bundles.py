"""Bundles and records from strangers: taken, or refused in one printable sentence."""

import contextlib
import json
import tracemalloc
from pathlib import Path
from random import Random

import pytest
import tomli_w

from controller.bundles import bundle, container
from controller.bundles.container import BundleError
from controller.bundles.deploy.store import (
    RECORD,
    BundleStore,
    InstalledRecord,
    StoredBundle,
    _text,
)
from controller.cli import install
from controller.recognition.debounce import Debouncer
from controller.recognition.images.preprocess import Preprocessor
from tests.support import hostile_bundles

PARTS = hostile_bundles.parts()
SETTINGS = """
    scale start_s follow_s settle_s gate gate_noise adopt_s smoothing on off floor noise
    temperature accept stay forget_s pitch_mm
"""


def read(folder: Path, manifest: bytes) -> bundle.Bundle | str:
    """The bundle that a manifest makes, or why it makes none."""
    path = folder / "x.orb"
    path.write_bytes(hostile_bundles.packed(manifest, PARTS))
    try:
        return bundle.read(path)
    except BundleError as error:
        return str(error)


def test_a_thousand_manifests_are_bundles_or_one_sentence(tmp_path: Path) -> None:
    taken = refused = 0
    for manifest in hostile_bundles.manifests(1000, seed=2026):
        found = read(tmp_path, manifest)
        if isinstance(found, str):
            assert found.isprintable()
            assert len(found) < 400 + len(str(tmp_path))
            refused += 1
            continue
        taken += 1
        Preprocessor(found.preprocess, found.rows, found.columns)
        Debouncer(found.labels, found.debounce)
        assert list(install._card(found.card))
        json.dumps(found.card, default=str)
        tomli_w.dumps(container.manifest(manifest))  # what is written when more is learned
    assert taken > 20  # a generator that is refused always would find nothing
    assert refused > 600


def test_three_hundred_records_are_read_or_refused_in_one_sentence(tmp_path: Path) -> None:
    entries = (
        StoredBundle("0" * 16, 50.0, "today"),
        StoredBundle("f" * 16, 60.0, "now"),
    )
    text, draw, taken = _text(InstalledRecord("f" * 16, "0" * 16, entries)), Random(2026), 0
    for _ in range(300):
        (tmp_path / RECORD).write_bytes(hostile_bundles.changed(text, draw))
        with contextlib.suppress(BundleError):
            BundleStore(tmp_path).record()
            taken += 1
    assert 3 < taken < 200


@pytest.mark.parametrize("line", ["x" + ".a" * 30_000, "[" + "a." * 30_000 + "a]", "a" * 70_000])
def test_a_manifest_of_gigabytes_is_refused_at_little_memory(tmp_path: Path, line: str) -> None:
    path = tmp_path / "x.orb"
    path.write_bytes(hostile_bundles.packed(f"{line} = 1\n".encode(), PARTS))
    tracemalloc.start()
    try:
        with pytest.raises(BundleError, match="has a manifest that cannot be used: "):
            bundle.read(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 20e6


@pytest.mark.parametrize("name", SETTINGS.split())
@pytest.mark.parametrize("value", ["0x" + "f" * 400, "9" * 19, "1e300", "inf", "nan", "-0.1"])
def test_no_number_of_a_manifest_ends_in_a_traceback(tmp_path: Path, name: str, value: str) -> None:
    text = hostile_bundles.TEXT
    lines = [f"{name} = {value}" if x.startswith(f"{name} = ") else x for x in text.split("\n")]
    told = read(tmp_path, "\n".join(lines).encode())
    assert f"has {name} = " in str(told) or "does not fit 64 bits" in str(told)


def test_ten_thousand_users_are_refused_before_they_are_compared(tmp_path: Path) -> None:
    many = ", ".join(f'"u{number}"' for number in range(5000))
    text = hostile_bundles.TEXT.replace('["ann", "bob"]', f"[{many}]")
    assert "expected is 1 to 32 different names" in str(read(tmp_path, text.encode()))
