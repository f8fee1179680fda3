"""Fixtures of the game's window, shared by its tests."""

from collections.abc import Iterator
from pathlib import Path

import pygame
import pytest

from tests.support.tetris_player import Player, open_app, opened


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> Iterator[pygame.Surface]:
    yield from opened(monkeypatch)


@pytest.fixture
def player(window: pygame.Surface, tmp_path: Path) -> Player:
    return open_app(window, config=tmp_path / "config", data=tmp_path / "data")
