"""Films of replays: as long as the game was, and nothing left behind where they fail."""

import sys
from pathlib import Path
from typing import Any

import pygame
import pytest

from tests.support.pytest_types import Capture, Patch
from tetris.__main__ import main
from tetris.engine.game import Action
from tetris.history.replay import Recorder, Replay
from tetris.history.replay_file import save
from tetris.window import video
from tetris.window.video import VideoError

SMALL = (160, 144)


@pytest.fixture(autouse=True)
def unseen(monkeypatch: Patch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    video.unseen()


def short() -> Replay:
    recorder = Recorder(1)
    recorder.update(0.0)
    recorder.update(0.5, [Action.LEFT])
    recorder.update(1.0, [Action.HARD_DROP])
    recorder.update(1.5)
    return recorder.replay()


def test_a_gif_lasts_as_long_as_the_game_and_a_rest(tmp_path: Path) -> None:
    image_module = pytest.importorskip("PIL.Image")
    path = tmp_path / "game.gif"
    shares = list(video.export(short(), path, size=SMALL))
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    with image_module.open(path) as image:
        assert image.size == SMALL
        total_ms = 0
        for frame in range(image.n_frames):
            image.seek(frame)
            total_ms += image.info["duration"]
    assert total_ms == pytest.approx(3500, abs=100)
    assert list(tmp_path.iterdir()) == [path]


def test_the_pictures_of_a_gif_are_the_windows_own(tmp_path: Path, monkeypatch: Patch) -> None:
    image_module = pytest.importorskip("PIL.Image")
    path = tmp_path / "game.gif"
    pictures: list[bytes] = []
    drawn_of = video._drawn

    def watched(*given: Any) -> bytes:
        pictures.append(drawn_of(*given))
        return pictures[-1]

    monkeypatch.setattr(video, "_drawn", watched)
    list(video.export(short(), path, size=SMALL))
    with image_module.open(path) as image:
        drawn = image.convert("RGB").tobytes()
    difference = [abs(a - b) for a, b in zip(pictures[video._SAMPLES], drawn, strict=True)]
    assert sum(difference) / len(difference) < 3  # 256 colours of 16 million


def test_an_mp4_has_thirty_pictures_a_second(tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    path = tmp_path / "game.mp4"
    list(video.export(short(), path, size=SMALL, speed=2.0))
    with av.open(str(path)) as container:
        pictures = [(frame.width, frame.height) for frame in container.decode(video=0)]
    assert set(pictures) == {SMALL}
    assert len(pictures) == pytest.approx((1.5 / 2 + 2.0) * 30, abs=2)


def test_pauses_are_left_out(tmp_path: Path) -> None:
    pytest.importorskip("PIL")
    recorder = Recorder(1)
    for time_s, action in ((0.0, Action.LEFT), (0.2, Action.PAUSE), (3600.0, Action.PAUSE)):
        recorder.update(time_s, [action])
    recorder.update(3600.2)
    pictures = list(video.export(recorder.replay(), tmp_path / "game.gif", size=SMALL))
    assert len(pictures) < 20 * 3


def test_a_film_that_is_given_up_leaves_nothing(tmp_path: Path) -> None:
    pytest.importorskip("PIL")
    steps = video.export(short(), tmp_path / "game.gif", size=SMALL)
    next(steps)
    assert list(tmp_path.iterdir())
    steps.close()  # type: ignore[attr-defined]
    assert list(tmp_path.iterdir()) == []


def test_another_kind_of_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(VideoError, match=r"a \.gif or a \.mp4 file, not game\.avi"):
        list(video.export(short(), tmp_path / "game.avi", size=SMALL))


@pytest.mark.parametrize(
    ("suffix", "module", "library"), [("gif", "PIL", "Pillow"), ("mp4", "av", "PyAV")]
)
def test_without_its_library_a_sentence_says_what_to_install(
    suffix: str, module: str, library: str, tmp_path: Path, monkeypatch: Patch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(VideoError, match=rf"{library}.* pip install 'orbtouch\[film\]'"):
        list(video.export(short(), tmp_path / f"game.{suffix}", size=SMALL))
    assert list(tmp_path.iterdir()) == []


def test_the_command_line_saves_a_film(tmp_path: Path, capsys: Capture) -> None:
    pytest.importorskip("PIL")
    save(tmp_path / "game.tetris", short())
    target = tmp_path / "game.gif"
    command = ["--replay", str(tmp_path / "game.tetris"), "--film", str(target), "--speed", "20"]
    assert main(command) == 0
    assert capsys.readouterr().out == f"{target}\n"
    assert target.read_bytes()[:6] == b"GIF89a"
    assert main([*command[:3], str(tmp_path / "none" / "game.gif")]) == 1
    assert "cannot write" in capsys.readouterr().err


def test_drawing_needs_no_window() -> None:
    assert pygame.display.get_driver() == "dummy"
