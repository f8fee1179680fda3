"""The orb on the screen: what is remembered of it, and that its picture shows it."""

import dataclasses
import os
from collections.abc import Iterator

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")

import numpy as np
import pygame
import pytest

from controller.shared.notices import notice
from controller.shared.protocol import messages
from controller.shared.protocol.codec import quantise_image
from controller.shared.protocol.messages import COMMANDS, Command, Contact, Telemetry, Welcome
from controller.shared.protocol.teaching import GestureInfo, Vocabulary
from host.app.application import OrbApp
from host.connection.receiver import Connected, Delivered, Lost, Received
from host.ui import naming, orb_state, sprites
from host.ui.orb_state import OrbState
from host.ui.panel.panel import Panel, Projection
from host.ui.panel.panel_layout import HEIGHT, WIDTH, Dock
from host.ui.pointer_input import DomeArea
from tetris.kit import language
from tetris.kit.settings import Look, Settings
from tetris.kit.theme import PALETTES
from tetris.window.screen_flow import Start

LABELS = ("null", "press", "pinch", "twist_cw", "twist_ccw")
WELCOME = Welcome(1, 7, "virtual-1", "OrbTouch", True, 5, 5, 10.0, 10.0, 100, 300, LABELS, COMMANDS)
RECT = pygame.Rect(0, 0, WIDTH, HEIGHT)


def telemetry(
    z: "np.ndarray[tuple[int, int], np.dtype[np.float64]]", **changes: object
) -> Telemetry:
    fields: dict[str, object] = {
        "frame": 1,
        "image": quantise_image(z.ravel()),
        "probabilities": (0.0, 1.0, 0.0, 0.0, 0.0),
        "touch": None,
        "gesture": "",
        "ready": True,
        "rate_hz": 10.0,
    }
    return Telemetry(**{**fields, **changes})  # type: ignore[arg-type]


def live_view() -> OrbState:
    view = OrbState()
    view.connected(WELCOME)
    view.telemetry(telemetry(np.ones((5, 5))), 0.0)
    return view


@pytest.fixture
def surface() -> Iterator[pygame.Surface]:
    pygame.display.init()
    yield pygame.display.set_mode((WIDTH, HEIGHT))
    pygame.display.quit()


def placed() -> Panel:
    panel = Panel()
    panel.place(RECT, DomeArea())
    return panel


def drawn(view: OrbState, surface: pygame.Surface, now_s: float = 10.0) -> pygame.Surface:
    view.advance(now_s - 5.0)
    view.advance(now_s)  # long enough for the shown image to have become the felt one
    placed().draw(surface, view, now_s, Look())
    return surface.copy()


def pixel(picture: pygame.Surface, x: float, y: float) -> pygame.Color:
    across, down = placed().projection.to_screen(x, y)
    return picture.get_at((round(across) + 6, round(down) + 6))  # beside the taxel's own mark


def test_image_and_probabilities_ease_towards_the_newest_ones_and_fade_in_silence() -> None:
    view = live_view()
    view.contacts = (Contact(0, 2, 2, 9, 7),)
    z = np.ones((5, 5))
    z[0, 4] = 1.2
    view.advance(0.0)
    view.advance(5.0)
    view.telemetry(telemetry(np.full((3, 3), 1.3)), 5.0)  # of a foreign shape: left out
    said = telemetry(z, probabilities=(0, 0, 1, 0, 0), rate_hz=9.5, gesture="press")
    view.telemetry(said, 5.0)
    view.advance(5.0 + orb_state.EASE_S)
    assert view.probabilities.tolist() == pytest.approx([0, 0.37, 0.63, 0, 0], abs=0.01)
    assert (view.rate_hz, view.gesture) == (9.5, "press")
    assert view.shown[0, 4] == pytest.approx(0.63 * 0.2, abs=0.01)
    view.silent("stale", "no word")
    view.advance(9.0)
    assert max(view.probabilities.max(), np.abs(view.shown).max()) < 0.01
    assert not view.gesture
    assert not view.contacts
    view.observe(Delivered(telemetry(z), 0), 9.0)  # the next word makes the link live again
    assert (view.link, view.reason) == ("live", "")


def test_an_orb_that_connects_anew_begins_with_a_blank_image_of_its_own_shape() -> None:
    view = live_view()
    view.connected(dataclasses.replace(WELCOME, rows=3, columns=4, labels=LABELS[:2]))
    assert (view.shape, len(view.probabilities)) == ((3, 4), 2)


def test_touches_and_faults_are_shown_and_forgotten_at_the_end(surface: pygame.Surface) -> None:
    view = live_view()
    pictures = [pygame.image.tobytes(drawn(view, surface), "RGB")]
    view.observe(Delivered(messages.UserIdentified("ann", 0.97), 0), 0.0)
    pictures.append(pygame.image.tobytes(drawn(view, surface), "RGB"))
    view.health = ("pressure down 6 %: pump (or the orb has cooled)", "and a second one")
    pictures.append(pygame.image.tobytes(drawn(view, surface), "RGB"))
    assert len(set(pictures)) == 3
    view.connected(WELCOME)
    assert (view.user, view.sure) == ("", 0.0)
    assert not view.health


def test_last_recognised_touch_is_marked_and_then_fades() -> None:
    view = live_view()
    view.command(Command("left", "press", 0.9, (0.5, 2.0), 1), 4.0)
    assert view.mark(4.0) == (0.5, 2.0, 1.0)
    assert view.mark(4.0 + orb_state.MARK_S / 4) == pytest.approx((0.5, 2.0, 0.75))
    assert view.mark(4.0 + orb_state.MARK_S) is None


def test_bulging_taxel_is_drawn_warmer_and_a_dented_one_colder(surface: pygame.Surface) -> None:
    calm = drawn(live_view(), surface)
    z = np.ones((5, 5))
    z[3, 1], z[1, 3] = 1.35, 0.65  # rows from the top: bulge at (1, 1), dent at (3, 3)
    view = live_view()
    view.telemetry(telemetry(z), 0.0)
    felt = drawn(view, surface)
    assert pixel(felt, 1, 1).g > pixel(calm, 1, 1).g + 30  # towards yellow
    assert pixel(felt, 3, 3).b > pixel(calm, 3, 3).b + 60  # towards blue
    assert pixel(felt, 3, 3).r < pixel(calm, 3, 3).r - 60
    assert pixel(felt, 4, 0) == pixel(calm, 4, 0)


def test_fingers_of_the_player_are_drawn_where_they_touch(surface: pygame.Surface) -> None:
    calm = drawn(live_view(), surface)
    view = live_view()
    view.contacts = (Contact(0, 3.0, 1.0, 9.0, 7.0),)
    touched = drawn(view, surface)
    assert pixel(touched, 3, 1) != pixel(calm, 3, 1)
    assert pixel(touched, 1, 3) == pixel(calm, 1, 3)


@pytest.mark.parametrize("size", [(5, 5), (4, 6), (8, 8)])
@pytest.mark.parametrize("link", ["connecting", "live", "stale", "lost"])
def test_every_shape_and_state_of_an_orb_can_be_drawn(
    surface: pygame.Surface, size: tuple[int, int], link: orb_state.LinkState
) -> None:
    rows, columns = size
    view = OrbState()
    view.connected(
        Welcome(1, 7, "a", "A", False, rows, columns, 8.0, 50.0, 100, 300, ("null", "poke"), ())
    )
    view.telemetry(
        telemetry(np.full(size, 1.1), probabilities=(0.2, 0.8), gesture="poke", ready=False), 0.0
    )
    view.command(Command("my_own", "poke", 0.9, (1.0, 1.0), 1), 0.0)
    if link != "live":
        view.silent(link, "a long reason that goes on and on " * 10)
    panel = Panel()
    panel.place(pygame.Rect(10, 10, 200, 400), DomeArea(rows, columns, 8.0))
    view.advance(0.5)
    panel.draw(surface, view, 0.5, Look())


def test_pixels_and_grid_units_are_each_others_inverse() -> None:
    projection = Projection(DomeArea(), (300.0, 200.0), 40.0)
    assert projection.to_screen(2.0, 2.0) == (300.0, 200.0)
    assert projection.to_screen(4.0, 4.0) == (380.0, 120.0)  # up on the dome is up on the screen
    assert projection.to_grid(*projection.to_screen(0.25, 3.5)) == pytest.approx((0.25, 3.5))


def test_the_newest_command_is_said_and_its_gesture_highlighted_until_they_fade(
    surface: pygame.Surface,
) -> None:
    view, panel = live_view(), placed()
    calm = drawn(view, surface)
    view.command(Command("left", "press", 0.9, None, 1), 10.0)
    panel.draw(surface, view, 10.5, Look(Settings(language="de")))
    assert panel._caption(view, 10.5)[0] == "drücken → links"
    row = panel.layout.rows[0]
    assert surface.subsurface(row).get_at((row.width // 2, 0)) != calm.get_at(row.midtop)
    assert drawn(view, surface, 13.0).get_at(row.midtop) == calm.get_at(row.midtop)


WIDE = "W" * 40
HUGE = 3e38


def whole_window(surface: pygame.Surface, *news: Received, health: tuple[str, ...] = ()) -> bytes:
    """Return the window of a game, the orb's panel painted over."""
    target = OrbApp(Start(seed=1), sound=False)
    target.tick(0.0, [news[0]])
    target.tick(0.1, news[1:])
    target.orb.hops, target.orb.period_ms = (messages.StageTime(WIDE, HUGE, HUGE, HUGE),) * 3, HUGE
    if health:
        target.orb.health = health
    target.draw(surface)
    surface.fill((0, 0, 0), Dock.of(surface.get_size()).panel)
    return pygame.image.tobytes(surface, "RGB")


@pytest.mark.parametrize("size", [(1280, 720), (640, 360), (1920, 1080)])
@pytest.mark.parametrize("place", [(2.0, 9.0), (HUGE, -HUGE), None])
@pytest.mark.parametrize("gesture", ["", WIDE])
@pytest.mark.parametrize("end", [(), (Lost(WIDE * 10),), (Lost("W " * 250),)])
def test_nothing_that_an_orb_says_is_drawn_outside_its_panel(
    surface: pygame.Surface,
    size: tuple[int, int],
    place: tuple[float, float] | None,
    gesture: str,
    end: tuple[Received, ...],
) -> None:
    window = pygame.Surface(size)
    said = dataclasses.replace(
        WELCOME, name="W" * 64, rate_hz=HUGE, labels=("null", WIDE, "wave", "twist_cw", "poke")
    )
    felt = telemetry(np.ones((5, 5)), rate_hz=HUGE, touch=place, gesture=gesture)
    command = Command(WIDE, WIDE, 1.0, place, 1)
    news = [Delivered(one, 0) for one in (felt, command, messages.UserIdentified(WIDE, 1.0))]
    long: list[Received] = [Connected(said), *news, *end]
    short: list[Received] = [Connected(WELCOME), *(Lost("gone") for _ in end)]
    health = (WIDE * 3, WIDE) if not gesture else ()
    assert whole_window(window, *long, health=health) == whole_window(window, *short)


def test_a_line_that_is_too_wide_is_made_to_fit() -> None:
    pygame.font.init()
    unit = sprites.SpriteScale(1.0)
    for width in range(20, 200, 10):
        assert unit.text(WIDE, 20, None, width).get_width() <= width


def test_a_panel_on_which_nothing_changes_is_copied_not_drawn(surface: pygame.Surface) -> None:
    view, panel = live_view(), placed()
    panel.draw(surface, view, 1.0, Look())
    composed: list[float] = []
    panel._compose = lambda view, now_s, *_: composed.append(now_s)  # type: ignore[method-assign]
    view.shown = view.shown + np.float32(0.003)  # the sensor's noise
    panel.draw(surface, view, 2.0, Look())
    assert composed == []
    view.shown = view.shown + np.float32(0.1)
    panel.draw(surface, view, 3.0, Look())
    assert composed == [3.0]


def test_colours_and_words_are_those_of_the_look(surface: pygame.Surface) -> None:
    view, panel = live_view(), placed()
    light = PALETTES["light"]
    panel.draw(surface, view, 1.0, Look(Settings(theme="light", language="fr")))
    assert surface.get_at((1, 1))[:3] == light.background
    assert (
        surface.get_at((panel.layout.card.centerx, panel.layout.card.top + 4))[:3] == light.surface
    )
    french = surface.copy()
    panel.draw(surface, view, 1.0, Look(Settings(theme="light", language="en")))
    assert pygame.image.tobytes(french, "RGB") != pygame.image.tobytes(surface, "RGB")


def test_health_is_said_in_the_language_in_use_as_far_as_it_is_known() -> None:
    french = language.load("fr")
    said = naming.said(french, notice("lead_off", notice("taxel", 0, 3)))
    assert said.startswith("un endroit de la peau : pas de signal")
    pressure = naming.said(french, notice("pressure_down", 6))
    assert pressure.startswith("pression en baisse de 6 %")
    assert naming.said(french, "a new kind of fault") == "a new kind of fault"


def test_gestures_and_commands_without_words_are_shown_by_their_names() -> None:
    german = language.load("de")
    assert naming.gesture(german, "twist_cw") == "rechts drehen"
    assert naming.gesture(german, "my_own") == "my own"
    assert naming.command(german, "volume_up") == "volume up"
    assert all(naming.command(german, name) != name for name in COMMANDS if name != "pause")


def test_gestures_are_kept_as_the_orb_describes_them() -> None:
    view = live_view()
    view.described(GestureInfo("press", "press", False, 0, b"", ()))
    view.described(GestureInfo("of_another_orb", "", False, 0, b"", ()))
    assert set(view.gestures) == {"press"}
    changed = Vocabulary(("null", "press", "wave"), COMMANDS, "", True, 1, "", "")
    view.described(changed)
    assert (view.gestures, view.labels) == ({}, changed.labels)
    view.described(GestureInfo("wave", "wave", True, 7, quantise_image([1.0] * 25), ()))
    view.telemetry(telemetry(np.ones((5, 5)), probabilities=(0.0, 0.0, 1.0)), 1.0)
    view.advance(1.0)
    view.advance(9.0)
    assert view.probabilities.tolist() == pytest.approx([0.0, 0.0, 1.0])


def test_a_taught_gesture_is_drawn_by_its_own_image(surface: pygame.Surface) -> None:
    pictures = []
    for taxel in (0, 24):
        z = np.ones(25)
        z[taxel] = 0.6
        view = live_view()
        view.described(GestureInfo("press", "press", True, 7, quantise_image(z), ()))
        drawn(view, surface)
        row = surface.subsurface(placed().layout.rows[0])
        pictures.append(pygame.image.tobytes(row, "RGB"))
    assert pictures[0] != pictures[1]


def test_a_ghost_hand_is_drawn_and_leaves_with_its_fingers(surface: pygame.Surface) -> None:
    view = live_view()
    calm = drawn(view, surface)
    view.ghost = (Contact(0, 3.0, 1.0, 7.0, 7.0),)
    assert pixel(drawn(view, surface), 3, 1) != pixel(calm, 3, 1)
    view.ghost = ()
    assert pixel(drawn(view, surface), 3, 1) == pixel(calm, 3, 1)


@pytest.mark.parametrize(("moved", "lively"), [(0.0, False), (0.2, True)])
def test_the_picture_moves_while_the_orb_is_touched(moved: float, lively: bool) -> None:
    view = live_view()
    view.telemetry(telemetry(np.full((5, 5), 1.0 - moved)), 0.0)
    view.advance(0.0)
    view.advance(9.0)
    assert view.lively(9.0) is lively
