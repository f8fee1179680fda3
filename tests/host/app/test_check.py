"""The page of the checks: a finger shows the place, and the verdict has the worst first."""

from controller.shared.protocol.messages import Command
from controller.shared.protocol.teaching import Check, CheckRow, CheckStep
from host.app.application import OrbApp
from host.app.screens.orbs import CheckScreen


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


def test_leaving_stops_the_check() -> None:
    app = OrbApp(sound=False)
    page = CheckScreen(app.stage, app)
    app.stage.push(page)
    page.leave()
    assert app.outgoing(0.0) == [Check(True), Check(False)]
