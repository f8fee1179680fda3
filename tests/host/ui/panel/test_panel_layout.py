"""Layout of the panel: its parts share any rectangle, and the dome stays large enough."""

import itertools

import pygame
import pytest

from host.ui.panel.panel_layout import Dock, PanelLayout

SIZES = [
    (640, 360), (800, 600), (960, 720), (1024, 768), (1280, 720), (1920, 1080), (2560, 1080),
    (3840, 2160), (1000, 1000), (360, 640), (720, 1280), (1080, 1920), (768, 1024),
]  # fmt: skip


def parts(layout: PanelLayout) -> list[pygame.Rect]:
    return [layout.header, layout.dome, layout.caption, layout.card]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("gestures", [1, 4, 7, 12])
@pytest.mark.parametrize("scale", [0.8, 1.0, 1.6])
def test_no_part_covers_another_or_leaves_the_panel(
    size: tuple[int, int], gestures: int, scale: float
) -> None:
    panel = Dock.of(size).panel
    layout = PanelLayout.of(panel, gestures, scale)
    for part in parts(layout):
        assert panel.contains(part)
    for first, second in itertools.combinations(parts(layout), 2):
        assert not first.colliderect(second)
    for row in layout.rows:
        assert layout.card.contains(row)
    for first, second in itertools.combinations(layout.rows, 2):
        assert not first.colliderect(second)
    assert 2 * layout.radius >= 160


@pytest.mark.parametrize("size", SIZES)
def test_the_gestures_that_ship_all_have_a_row(size: tuple[int, int]) -> None:
    assert len(PanelLayout.of(Dock.of(size).panel, 4).rows) == 4


def test_in_a_tall_window_the_card_is_beside_the_dome() -> None:
    layout = PanelLayout.of(Dock.of((720, 1280)).panel, 4)
    assert layout.card.left >= layout.dome.right
    assert layout.caption.top == layout.dome.bottom


@pytest.mark.parametrize("size", SIZES)
def test_the_dome_stays_where_it_is_as_gestures_are_taught(size: tuple[int, int]) -> None:
    panel = Dock.of(size).panel
    assert len({PanelLayout.of(panel, gestures).dome.topleft for gestures in (1, 4, 7, 12)}) == 1
    assert len(PanelLayout.of(panel, 7).rows) == 7


def test_larger_text_has_a_higher_line() -> None:
    panel = Dock.of((1280, 720)).panel
    usual, large = PanelLayout.of(panel, 4), PanelLayout.of(panel, 4, 1.6)
    assert large.caption.height > usual.caption.height
