"""The pictures of docs/simulator.md can be drawn anew."""

from pathlib import Path

import pytest


@pytest.mark.train
def test_a_checkout_can_draw_the_documentations_pictures(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib", reason="needs the [train] extra")
    from matplotlib import rc_context

    from tests.reference import pictures

    with rc_context(pictures.STYLE):
        for draw, name in (
            (pictures.inflation, "inflation.svg"),
            (pictures.touched, "touched.svg"),
        ):
            draw(tmp_path)
            assert (tmp_path / name).stat().st_size > 20_000
