"""A gesture of two fingers is taught by a phone's page, in a browser."""

from pathlib import Path

import pytest

from host.app.screens.teach.gesture import ENOUGH, GesturePage
from tests.host.phone import test_phone_page
from tests.host.phone.test_phone_page import APART_S, pinch, playing

pytestmark = test_phone_page.pytestmark


def test_a_squeeze_is_taught_and_tried(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))  # for this orb only
    squeeze = [*pinch(0.6, steps=14), *pinch(0.6, steps=14)[::-1]], 0.05
    with playing() as play:
        for item in ("Teach", "New gesture…", "squeeze"):
            play.choose(item)
        page = play.app.stage.screen
        assert isinstance(page, GesturePage)
        for _ in range(ENOUGH):
            play.stroke(*squeeze)
            play.play(APART_S)  # in which the orb answers
            if page.doubt:
                play.choose("Keep it")
        play.choose("Learn")
        play.until(lambda: page.mode == "trial")
        for _ in range(4):
            play.stroke(*squeeze)
        play.play(APART_S)
        assert page.trial.count("squeeze")[0] >= 3, page.trial.heard
