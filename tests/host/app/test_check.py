"""The page of the checks: a finger shows the place, and the verdict has the worst first."""

from controller.shared.notices import notice
from controller.shared.protocol.messages import Command
from controller.shared.protocol.teaching import Check, CheckRow, CheckStep
from host.app.application import OrbApp
from host.app.screens.orbs import CheckScreen, PresentOrbScreen
from host.connection.receiver import Lost
from tests.support.app_window import WELCOME, Window


def test_a_check_is_led_and_judged() -> None:
    app = OrbApp(sound=False)
    page = CheckScreen(app.stage, app)
    app.stage.push(page)
    assert app.outgoing(0.0) == [Check(True)]
    page.report(CheckStep("press", 1, 3, 0.5), 1.0)
    (finger,) = app.ghost
    assert (finger.x, finger.y) == (3.0, 3.0)  # rows count from the top, y from below
    assert page.recognised(Command("left", "press", 0.9, None, 1), 1.5)
    for name, verdict in (("disk", "good"), ("row 2", "FAULT"), ("level", "doubtful")):
        page.report(CheckRow(name, verdict, "found", "", ""), 2.0)
    page.report(CheckStep("over", 0, 0, 1.0), 3.0)
    assert app.ghost == ()
    assert [item.label for item in page.page().items[:3]] == ["row 2", "level", "disk"]


def test_the_dome_shows_the_place_that_a_line_is_about() -> None:
    app = OrbApp(sound=False)
    page = CheckScreen(app.stage, app)
    app.stage.push(page)
    stiff = notice("stiff", 40.0)
    page.report(
        CheckRow(notice("taxel_at", 1, 3), "doubtful", stiff, notice("stiff_advice"), ""), 1.0
    )
    page.report(CheckStep("over", 0, 0, 1.0), 1.0)
    page.tick(1.1)
    (finger,) = app.ghost
    assert (finger.x, finger.y) == (3.0, 3.0)
    assert page.menu.items[0].label == "one place of the skin"
    page.selected = 1
    page.tick(1.2)
    assert app.ghost == ()


def test_a_fault_of_the_skin_leads_to_the_check_and_details_have_its_numbers() -> None:
    window = Window()
    page = PresentOrbScreen(window.app.stage, window.app)
    window.app.stage.push(page)
    assert page.menu.items[0].label == "Measure the rest image again"
    window.app.orb.health = (notice("no_signal", notice("taxel", 2, 1)),)
    page.rebuild()
    assert page.menu.items[0].label == "Calibrate and check"
    assert "one place of the skin: no signal" in _text(page)
    assert page.menu.items[3].do
    page.menu.items[3].do()
    page.rebuild()
    assert "taxel row 2, column 1: no signal" in _text(page)
    assert WELCOME.device_id in _text(page)


def _text(page: PresentOrbScreen) -> str:
    return " ".join(cell for row in page.menu.table for cell in row.cells)


def test_nothing_waits_for_an_orb_that_is_there() -> None:
    window = Window()
    page = CheckScreen(window.app.stage, window.app)
    assert page.menu.table[0].cells == ("The orb begins the check.",)
    window.pass_s(0.1, Lost("gone"))
    page.rebuild()
    assert page.menu.table[0].cells == ("gone",)


def test_leaving_stops_the_check() -> None:
    app = OrbApp(sound=False)
    page = CheckScreen(app.stage, app)
    app.stage.push(page)
    page.leave()
    assert app.outgoing(0.0) == [Check(True), Check(False)]
