"""Signals to `host` and its watchdog, at random: no key stays down while one of them runs.

    python -m tests.benchmarks.key_signals [--rounds N] [--seed N]

It needs Debian's xvfb and the [keys] extra. A round starts an orb and a `host` that presses keys
under Xvfb, lets the orb press something, and sends one to four signals to host, watchdog or both.
It ends with a polite signal to the host or with the loss of the link. Then no key may be down 1.1 s
after the last of it, nor may one go down again. Rounds after which neither process ran on, nor
ended by itself, are the documented exception (docs/keys.md); they are listed, and not counted.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from tests.support.x_programs import PATIENCE_S, Orb, Player, server

UP_S: Final = 1.1  # after the last signal every key is up
WATCH_S: Final = 0.3  # longer, that none goes down again
SIGNALS: Final = ("SIGKILL", "SIGSTOP", "SIGTERM", "SIGINT", "SIGHUP")
POLITE: Final = ("SIGTERM", "SIGINT", "SIGHUP")
ENDS: Final = (*POLITE, "orb killed", "orb silent")
VICTIMS: Final = ("host", "guard", "guard", "both")
MAPPING: Final = """
[everywhere]
menu = { arm = true }

[profile.game]
down = { key = "down", mode = "hold" }
hold = { key = "ctrl", mode = "toggle" }
right = { key = "right", mode = "repeat" }
drop = "space"
left = { key = "shift+a" }
rotate_cw = { key = "ctrl+b" }
"""
STROKES: Final = ("hold down", "tap hold", "hold right", "tap drop", "tap left", "tap rotate_cw")


class Board(Protocol):
    """A keyboard or pad as the system sees it."""

    def down(self) -> Sequence[object]:
        """Return what is down."""

    def lift(self) -> None:
        """Release what a round has left down."""


@dataclass(frozen=True)
class Plan:
    """A round."""

    stroke: str  # the line for the orb
    # signals in order: (seconds after the stroke, name, who gets it)
    acts: tuple[tuple[float, str, str], ...]
    end: str  # how it ends, one of ENDS
    end_s: float  # when, seconds after the stroke

    def __str__(self) -> str:
        acts = ", ".join(f"{at_s:.3f} {name} {victim}" for at_s, name, victim in self.acts)
        return f"{self.stroke}: {acts}; {self.end_s:.3f} {self.end}"


@dataclass(frozen=True)
class Outcome:
    """What came of a round."""

    survivor: bool  # whether a process ran on, or ended by itself
    pressed: bool  # whether a key was seen down
    up_s: float  # when one was last seen down, seconds after the last signal; 0: before it
    stuck: tuple[object, ...]  # what was down at the end
    limit_s: float  # when every key has to be up
    crashed: bool  # whether the host ended in a traceback of what presses keys

    @property
    def ok(self) -> bool:
        """Whether every key was up in time, and stayed up."""
        return not (self.stuck or self.crashed) and self.up_s <= self.limit_s


def plan(rng: random.Random, strokes: Sequence[str] = STROKES) -> Plan:
    acts: list[tuple[float, str, str]] = []
    at_s = rng.uniform(0, 0.1)
    for _ in range(rng.choice((1, 1, 2, 2, 3))):
        name, victim = rng.choice(SIGNALS), rng.choice(VICTIMS)
        acts.append((at_s, name, victim))
        if name == "SIGSTOP" and rng.random() < 0.4:
            acts.append((at_s + rng.uniform(0.01, 1.2), "SIGCONT", victim))
        at_s += rng.choice((0.0, rng.uniform(0, 0.03), rng.uniform(0, 0.5)))
    end_s = max(act[0] for act in acts) + rng.choice((0.0, rng.uniform(0, 0.3)))
    return Plan(rng.choice(strokes), tuple(sorted(acts)), rng.choice(ENDS), end_s)


def play(plan: Plan, board: Board, orb: Orb, host: Player, limit_s: float) -> Outcome:
    """Play a round with an armed host, which is dead afterwards, like the orb."""
    pids = {"host": [host.process.pid], "guard": [host.guard()]}
    pids["both"] = pids["host"] + pids["guard"]
    down: Sequence[object] = ()
    seen_s = 0.0

    def watch(until_s: float) -> None:
        nonlocal down, seen_s
        while time.monotonic() < until_s:
            if down := board.down():
                seen_s = time.monotonic()
            time.sleep(0.001)

    orb.say(plan.stroke)
    start_s = time.monotonic()
    for at_s, name, victim in (*plan.acts, (plan.end_s, plan.end, "host")):
        watch(start_s + at_s)
        if name.startswith("orb"):
            orb.process.send_signal(signal.SIGKILL if name == "orb killed" else signal.SIGSTOP)
        else:
            for pid in pids[victim]:
                send(pid, name)
    last_s = time.monotonic()
    watch(last_s + limit_s + WATCH_S)
    killed = {v for _, name, victim in plan.acts if name == "SIGKILL" for v in expand(victim)}
    code = host.process.poll()
    host_lost = state(host.process.pid) == "T" or code == -signal.SIGKILL
    guard_lost = "guard" in killed or state(pids["guard"][0]) == "T"
    survivor = not (host_lost and guard_lost)
    for pid in pids["both"]:
        send(pid, "SIGKILL")
    assert host.process.stderr is not None
    crashed = "host/injection" in host.process.stderr.read()
    host.end()
    late_s = max(seen_s - last_s, 0)
    return Outcome(survivor, seen_s > 0, late_s, tuple(down), limit_s, crashed)


def armed(orb: Orb, host: Player) -> bool:
    """Arm; return False if a busy machine has missed the command."""
    timer = threading.Timer(PATIENCE_S, host.process.kill)
    timer.start()
    try:
        orb.say("tap menu")
        host.until("armed by the orb")
    except AssertionError:
        return False
    finally:
        timer.cancel()
    return True


def expand(victim: str) -> tuple[str, ...]:
    """Return the processes that a victim stands for."""
    return ("host", "guard") if victim == "both" else (victim,)


def send(pid: int, name: str) -> None:
    """Send a signal to a process that may have gone."""
    with contextlib.suppress(ProcessLookupError):
        if state(pid) not in ("", "Z"):
            os.kill(pid, getattr(signal, name))


def state(pid: int) -> str:
    """Return the letter of a process's state in /proc, "" if there is none."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return ""


def rounds(
    board: Board,
    start: Callable[[Orb], Player],
    *,
    seed: int,
    count: int,
    strokes: Sequence[str] = STROKES,
    limit_s: float = UP_S,
    say: Callable[[str], object] = print,
) -> list[tuple[Plan, Outcome]]:
    """Play until `count` rounds had a survivor; return all. Every key has to be up at `limit_s`."""
    rng = random.Random(seed)
    played: list[tuple[Plan, Outcome]] = []
    while sum(outcome.survivor for _, outcome in played) < count:
        what = plan(rng, strokes)
        orb = Orb()
        try:
            host = start(orb)
            while not armed(orb, host):
                host.end()
                host = start(orb)
            outcome = play(what, board, orb, host, limit_s)
        finally:
            orb.process.kill()
            orb.process.communicate()
        played.append((what, outcome))
        board.lift()
        if not outcome.survivor:
            left = "left a key down" if outcome.stuck else "left no key down"
            say(f"{len(played)} no survivor, {left}: {what}")
        elif not outcome.ok:
            say(f"{len(played)} FAILED, {outcome}: {what}")
    return played


def summary(played: Sequence[tuple[Plan, Outcome]]) -> str:
    """Return the figures of some rounds, one line."""
    counted = [outcome for _, outcome in played if outcome.survivor]
    others = [outcome for _, outcome in played if not outcome.survivor]
    late = sorted(outcome.up_s for outcome in counted)
    return (
        f"{len(counted)} rounds, in {sum(o.pressed for o in counted)} a key was seen down, "
        f"{sum(not o.ok for o in counted)} failed; "
        f"the last went up after {late[len(late) // 2]:.3f} s (median), {late[-1]:.3f} s (longest)"
        f"; {len(others)} rounds without a survivor left {sum(bool(o.stuck) for o in others)} "
        "times a key down"
    )


def main() -> int:
    """Play, print the figures, and return 0 if every key went up in time."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rounds", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for number in (signal.SIGINT, signal.SIGHUP):  # ignored in a shell's background, by nohup
        signal.signal(number, signal.SIG_DFL)
    with tempfile.TemporaryDirectory() as folder, server() as screen:
        mapping = Path(folder) / "keys.toml"
        mapping.write_text(MAPPING)
        played = rounds(
            screen,
            lambda orb: Player(screen.environment, orb, mapping),
            seed=options.seed,
            count=options.rounds,
        )
    print(f"seed {options.seed}: {summary(played)}")
    return 0 if all(outcome.ok for _, outcome in played if outcome.survivor) else 1


if __name__ == "__main__":
    sys.exit(main())
