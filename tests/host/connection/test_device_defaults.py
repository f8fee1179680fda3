"""A device and what it played, from one run of `host` to the next, on whatever port."""

import contextlib
import dataclasses
from pathlib import Path

import pytest

from controller.links import open_link
from host.__main__ import main
from host.connection.device_store import DeviceStore
from tests.support.fake_device import welcome
from tests.support.pytest_types import Capture, Patch
from tests.support.serial_cable import Cable

MAPPING = """
[profile.game]
drop = "space"
pause = { profile = "desk" }
menu = { arm = true }
[profile.desk]
drop = "a"
menu = { arm = true }
"""


@pytest.fixture
def config(tmp_path: Path, monkeypatch: Patch) -> Path:
    path = tmp_path / "devices.toml"
    monkeypatch.setattr("host.connection.device_store.default_path", lambda: path)
    return path


def plugged(stack: contextlib.ExitStack, device_id: str) -> str:
    """Put a device behind a new port, and return the port."""
    cable = Cable()
    stack.callback(cable.close)
    known = dataclasses.replace(welcome(virtual=False), device_id=device_id, name="Blue")
    link = open_link(cable.ends[0], known)
    stack.callback(link.close)
    return cable.ends[1]


def test_device_plays_its_last_anywhere(config: Path, tmp_path: Path, monkeypatch: Patch) -> None:
    keys = tmp_path / "mine.toml"
    keys.write_text(MAPPING)
    usual = ["--headless", "--seconds", "0.3", "--backend=print"]
    with contextlib.ExitStack() as stack:
        port = plugged(stack, "orb-1")
        chosen = ["--target", "keyboard", "--mapping", str(keys), "--profile", "desk"]
        assert main(["--link", port, *chosen, *usual]) == 0
    [known] = DeviceStore().devices
    assert (known.device_id, known.name, known.port) == ("orb-1", "Blue", port)
    assert (known.target, known.keys, known.profile) == ("keyboard", str(keys), "desk")
    with contextlib.ExitStack() as stack:
        # Its old port's number may well come again, with somebody else behind it.
        ports = [plugged(stack, name) for name in ("orb-2", "orb-1")]
        monkeypatch.setattr("host.connection.discovery.listed", lambda everything: [])
        assert main(["--link", ports[0], "--target", "keyboard", *usual]) == 0
        DeviceStore().remember(
            "orb-3", port=ports[1]
        )  # a port that is asked, under another identity
        assert main(["--device", "orb-1", *usual]) == 0
        [again] = DeviceStore().named("orb-1")
        assert again.port == ports[1]
        assert dataclasses.replace(again, port=port, seen=known.seen) == known


def test_profile_that_the_mapping_has_not_is_one_sentence(tmp_path: Path, capsys: Capture) -> None:
    keys = tmp_path / "mine.toml"
    keys.write_text(MAPPING)
    arguments = ["--target", "keyboard", "--headless", "--backend=print", "--mapping", str(keys)]
    assert main([*arguments, "--profile", "slides"]) == 2
    told = capsys.readouterr().err
    assert told == "host: there is no profile 'slides'; there are: game, desk\n"
