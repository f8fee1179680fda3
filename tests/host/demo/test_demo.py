"""The demo: the player's manners, the record's arithmetic, and a real game of two processes."""

import json
import subprocess
import sys

from controller.shared.protocol.messages import Command, GroundTruth, Welcome
from host.__main__ import main
from host.connection.receiver import Delivered
from host.demo import demo
from host.demo.autoplayer import COMMAND_OF, MANUAL, Autoplayer, DemoRecord
from tests.support.pytest_types import Capture
from tetris.engine.game import Action, Game


def command(name: str) -> Delivered:
    return Delivered(Command(name, "press", 0.99, None, 1), 0)


def test_a_record_judges_every_gesture_by_the_command_it_meant() -> None:
    record = DemoRecord(meant={1: "left", 2: "", 3: "drop", 4: "right"})
    record.take([command("left")], 1400)
    record.take([Delivered(GroundTruth(1, "press", 1000, 1900), 1900)], 1900)
    record.take([Delivered(GroundTruth(2, "brush", 3000, 3500), 3500)], 3500)
    record.take([command("left"), Delivered(GroundTruth(3, "pinch", 5000, 6000), 6000)], 5500)
    record.take([Delivered(GroundTruth(4, "press", 8000, 8500), 8500)], 8500)
    verdict = record.verdict(1, 10.0)
    assert [verdict[k] for k in ("intended", "hits", "wrong", "missed")] == [3, 1, 1, 2]
    assert (verdict["false_alarms"], verdict["stray_touches"]) == (0, 1)
    stray = DemoRecord(meant={1: ""})
    stray.take([command("left"), Delivered(GroundTruth(1, "rest", 1000, 1900), 1900)], 1400)
    assert stray.verdict(1, 3.0)["false_alarms"] == 1
    assert verdict["latency_s"] == {"p50": 0.4, "p95": 0.4}
    # What was meant, beside what was understood ("commands"): the channel as it was played.
    assert verdict["events"] == [[1000, 1900, "left"], [5000, 6000, "drop"], [8000, 8500, "right"]]


def test_the_player_means_only_what_the_manual_says_and_waits_for_its_hand() -> None:
    player, game = Autoplayer(3, 120.0), Game(3)
    game.update(0.0)
    meant, now = [], 0.0
    while now < 100.0:
        decision = player.decide(game, now)
        if decision is not None:
            performance, name = decision
            if name:
                label, (x, y) = MANUAL[name]
                assert performance.label == label
                assert abs(performance.x - x) < 1.0
                assert abs(performance.y - y) < 1.0
                action = next(a for a, c in COMMAND_OF.items() if c == name)
                game.update(now, [action])
            assert player.decide(game, now + 0.01) is None  # the hand is busy
            meant.append(name)
            now += 0.9
            player.left(performance.number, now)
        now += 1 / 60
        game.update(now)
    assert meant.count("") >= 100 / 60 * 2  # stray touches: at least two a minute
    assert set(meant) - {""} <= set(MANUAL)
    assert player.decide(game, 117.5) is None  # too late to be answered in time


ANNOUNCED = ("left", "right", "down", "drop", "rotate_cw", "rotate_ccw")
SHIPPED = ("null", "press", "pinch", "twist_cw", "twist_ccw")


def holds(labels: tuple[str, ...], commands: tuple[str, ...]) -> set[str]:
    """Return the gestures by which a player holds with an orb that announces these."""
    player, game, now, made = Autoplayer(3, 200.0), Game(3), 0.0, set()
    player.meet(Welcome(1, 1, "x", "x", True, 5, 5, 10.0, 10.0, 1000, 2000, labels, commands))
    game.update(0.0)
    while now < 190.0:
        decision = player.decide(game, now)
        if decision is not None:
            performance, name = decision
            if name == "hold":
                assert game.can_hold
                made.add(performance.label)
                game.update(now, [Action.HOLD])
            elif name:
                game.update(now, [next(a for a, c in COMMAND_OF.items() if c == name)])
            now += 0.9
            player.left(performance.number, now)
        now += 1 / 60
        game.update(now)
    return made


def test_the_player_holds_by_a_gesture_that_its_orb_was_taught() -> None:
    assert holds((*SHIPPED, "knock"), (*ANNOUNCED, "hold")) == {"knock"}


def test_the_player_does_not_guess_what_a_gesture_means() -> None:
    assert holds(SHIPPED, ANNOUNCED) == set()
    assert holds((*SHIPPED, "knock"), (*ANNOUNCED, "pause")) == set()
    assert holds((*SHIPPED, "knock", "wave"), (*ANNOUNCED, "hold")) == set()


def test_ticks_add_up_to_whole_seconds() -> None:
    assert [demo.until_ms(n) for n in (1, 2, 3, 60, 7200)] == [17, 33, 50, 1000, 120_000]


def test_a_demo_plays_and_the_same_seed_is_the_same_game(capsys: Capture) -> None:
    def play() -> dict[str, object]:
        assert main(["--demo", "--headless", "--json", "--seed", "2", "--seconds", "20"]) == 0
        verdict: dict[str, object] = json.loads(capsys.readouterr().out.splitlines()[-1])
        verdict.pop("link_bytes")  # handshakes differ by their nonces' lengths
        return verdict

    first = play()
    assert isinstance(first["intended"], int)
    assert first["intended"] >= 6
    assert play() == first


def test_a_demo_over_a_link_is_the_same_game_as_with_an_orb_of_its_own() -> None:
    command = [sys.executable, "-m", "controller", "--seed", "7", "--link", "listen://127.0.0.1:0"]
    command += demo.quick(())
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as orb:
        assert orb.stdout is not None
        url = json.loads(orb.stdout.readline())["listening"]
        games = []
        for link in (None, url):
            with demo.Demo(7, 7.0, link=link) as game:
                while not game.over:
                    game.tick()
                verdict = game.verdict()
            del verdict["link_bytes"]
            games.append(verdict)
        orb.terminate()
    assert games[0] == games[1]
    assert games[0]["commands"]


def test_a_demo_that_understood_nothing_has_no_median() -> None:
    verdict = {
        "seconds": 4.0, "pieces": 0, "lines": 0, "hits": 0, "intended": 0, "wrong": 0,
        "false_alarms": 0, "duplicates": 0, "latency_s": {"p50": None},
    }  # fmt: skip
    assert demo.summary(verdict).endswith("; - s from touch to action (median)")
