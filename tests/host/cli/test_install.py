"""`host install`: a bundle into a running orb, over a link that proves who is there."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from controller.bundles import bundle as bundles
from controller.bundles import container
from host.__main__ import main as host
from tests.support import hostile_bundles
from tests.support.pytest_types import Capture

Orb = tuple[str, Path, "subprocess.Popen[str]"]
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the orb is ended by a signal")


def variant(path: Path) -> str:
    """Write a bundle that differs from the shipped one in its card; return its name."""
    parts = container.unpack(bundles.default_path().read_bytes())
    text = parts[container.MANIFEST].replace(b"[card]\n", b'[card]\nvariant = "new"\n')
    bundles.write(path, manifest=text, parts={name: parts[name] for name in container.CONTENT})
    return bundles.read(path).hash[:16]


@pytest.fixture
def orb(tmp_path: Path) -> Iterator[Orb]:
    """A virtual orb with a key, and a shelf of its own: its URL, the key, and its process."""
    key = tmp_path / "key"

    command = [sys.executable, "-m", "controller", "--link", "listen://127.0.0.1:0", "--key"]
    environment = {**os.environ, "XDG_DATA_HOME": str(tmp_path), "XDG_RUNTIME_DIR": str(tmp_path)}
    with subprocess.Popen(
        [*command, str(key)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        url: str = json.loads(process.stdout.readline())["listening"]
        yield url, key, process
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)


@pytest.mark.slow
def test_an_orb_takes_a_bundle_and_goes_on(orb: Orb, tmp_path: Path, capsys: Capture) -> None:
    url, key, process = orb
    name = variant(tmp_path / "new.orb")
    link = ["--link", url, "--key", str(key)]
    assert host(["install", str(tmp_path / "new.orb"), *link]) == 0
    assert f"{name} is in use" in capsys.readouterr().out
    assert process.poll() is None
    # Once more, by another name: the orb is still there, and has what is on its shelf.
    other = (tmp_path / "new.orb").rename(tmp_path / f"{'é漢' * 40}.orb")
    assert host(["install", str(other), *link]) == 0


def test_a_bundle_of_gigabytes_is_declined(orb: Orb, tmp_path: Path, capsys: Capture) -> None:
    url, key, process = orb
    parts = container.content(container.unpack(bundles.default_path().read_bytes()))
    path = tmp_path / "bomb.orb"
    path.write_bytes(hostile_bundles.packed(f"x{'.a' * 30_000} = 1\n".encode(), parts))
    assert host(["install", str(path), "--link", url, "--key", str(key)]) == 1
    assert "line 1: a key has more than 16 parts" in capsys.readouterr().err
    assert process.poll() is None


def test_what_is_no_bundle_is_declined(orb: Orb, tmp_path: Path, capsys: Capture) -> None:
    url, key, _ = orb
    path = tmp_path / "song.orb"
    path.write_bytes(b"la la la" * 1000)
    assert host(["install", str(path), "--link", url, "--key", str(key)]) == 1
    assert "is damaged, or something else" in capsys.readouterr().err


def test_a_file_that_is_not_there_is_wrong_usage(capsys: Capture) -> None:
    assert host(["install", "nothing.orb", "--link", "socket://127.0.0.1:1"]) == 2
    assert "nothing.orb cannot be read" in capsys.readouterr().err
