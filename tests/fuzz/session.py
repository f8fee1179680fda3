"""The session, both ends: a wire that does anything, and packets that no side sent.

Each input is a story of `tests.support.link_simulator`, which compares what the host is told with
what was really asked for: a command reaches it at most once, in order, and only if the device gave
it. With a key that holds however much is forged; without one, noise is too short for a frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final

from controller.shared.protocol.packets import MAX_FRAME, encode
from tests.support.link_simulator import CHANGES, Wire, World

from .choices import Choices
from .decoder import MESSAGES

DICTIONARY: tuple[bytes, ...] = ()
_KEPT: Final = 4 * MAX_FRAME  # bytes that a session remembers, what is to be sent left out
_SHORTEST: Final = 15  # bytes of a frame: fewer cannot be forged into one


def _wire(world: World, choices: Choices) -> Wire:
    return choices.one_of((world.to_host, world.to_device))


def _noise(world: World, choices: Choices) -> None:
    size = choices.number() % (256 if world.keyed else _SHORTEST)
    _wire(world, choices).put(choices.octets(size), world.now_ms)


def _forge(world: World, choices: Choices) -> None:
    message, session, sequence = choices.one_of(MESSAGES), choices.number(2), choices.number(2)
    data = encode(message, session=session, sequence=sequence, t_ms=choices.number(2))
    wire = _wire(world, choices)
    if world.keyed:
        wire.put(data, world.now_ms)


def _cut(world: World, choices: Choices) -> None:
    known = choices.number()
    world.cut(8 * choices.number(), host_knows=bool(known & 1), device_knows=bool(known & 2))


_HAPPENINGS: Final[dict[str, Callable[[World, Choices], None]]] = {
    "wait": lambda world, choices: world.wait(choices.number(2) % 3000),
    "command": lambda world, choices: world.command(),
    "hold": lambda world, choices: world.hold(choices.one_of(((), ("down",)))),
    "feel": lambda world, choices: world.feel(),
    "stall": lambda world, choices: _wire(world, choices).stall(world.now_ms + choices.number()),
    "change": lambda world, choices: world.change(
        _wire(world, choices), choices.one_of(CHANGES), choices.number(2)
    ),
    "noise": _noise,
    "forge": _forge,
    "cut": _cut,
    "restart device": lambda world, choices: world.restart_device(),
    "restart host": lambda world, choices: world.restart_host(),
    "end host": lambda world, choices: world.end_host(),
}


def does(happening: str, *numbers: int) -> bytes:
    """Return the bytes that choose one thing to happen."""
    return bytes([list(_HAPPENINGS).index(happening), *numbers])


def wait(ms: int) -> bytes:
    """Return the bytes that let time pass."""
    return does("wait", *ms.to_bytes(2, "little"))


COMMAND: Final = does("command")


def seeds() -> Iterable[bytes]:
    """Return stories to begin with, without a key and with one."""
    for keyed in (b"\0", b"\1"):
        # A command whose packet comes twice.
        yield keyed + COMMAND + wait(1) + does("change", 0, 3, 0, 0) + wait(100)
        # A second one whose packet is lost and sent again.
        yield (
            keyed + COMMAND + wait(20) + COMMAND + wait(1) + does("change", 0, 1, 0, 0) + wait(280)
        )
        # One that is too old by then.
        yield keyed + does("cut", 3, 100) + COMMAND + wait(2900)
        # A packet that no side sent, noise, and a device that is restarted.
        forged = does("forge", 8, 1, 0, 9, 0, 0, 0, 0)
        yield keyed + forged + does("noise", 3, 1, 65, 0, 66) + does("restart device") + wait(900)


def tell(data: bytes) -> World:
    """Let all happen that bytes choose; AssertionError: a command is wrong, or memory grew."""
    choices = Choices(data)
    how = choices.number()
    world = World(serial=bool(how & 2), keyed=bool(how & 1), device_ms=how << 24)
    world.wait(100)
    while choices.left:
        _HAPPENINGS[choices.one_of(list(_HAPPENINGS))](world, choices)
        world.check()
        for session in (world.host, *world.lines):
            assert _remembers(session) <= _KEPT
    return world


def one(data: bytes) -> None:
    """Let everything happen that bytes choose."""
    tell(data)


def _remembers(session: object) -> int:
    """Return how many bytes and things a session keeps, what is to be sent left out."""
    total, waiting = 0, [session]
    while waiting:
        for name, value in getattr(waiting.pop(), "__dict__", {}).items():
            if isinstance(value, bytes | bytearray | list | tuple | dict | set):
                total += 0 if name == "output" else len(value)
            elif type(value).__module__.startswith(("controller.", "host.")):
                waiting.append(value)
    return total
