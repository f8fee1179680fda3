"""The tables of states: complete, reachable, the only way from state to state, and as drawn."""

import ast
from collections.abc import Sequence
from pathlib import Path

import pytest

from controller.links import byte_link
from controller.protocol import device_session, messages, states
from controller.protocol import host_session as host_session
from controller.protocol.link_events import BACKOFF_S
from controller.protocol.retransmit import RESEND_MS
from controller.protocol.states import DEVICE, EVENTS, HOST, Transition, next_states
from host.connection import receiver
from tests.support import ROOT

PAGE = ROOT / "docs" / "link.md"
TABLES = [("device", DEVICE, "waiting"), ("host", HOST, "over")]


def drawn(table: Sequence[Transition], first: str) -> str:
    """Return a table as a state diagram, in Mermaid's words."""
    lines = ["stateDiagram-v2", f"    [*] --> {first}"]
    arrows: dict[tuple[str, str], list[str]] = {}
    for row in table:
        for state in row.states:
            arrows.setdefault((state, row.to), []).append(row.event)
    lines += [f"    {at} --> {to}: {', '.join(events)}" for (at, to), events in arrows.items()]
    return "\n".join(lines)


def listed(table: Sequence[Transition]) -> str:
    """Return a table as Markdown."""
    lines = ["| in | when | goes to | and does |", "|---|---|---|---|"]
    lines += [f"| {', '.join(row.states)} | {row.event} | {row.to} | {row.does} |" for row in table]
    return "\n".join(lines)


@pytest.mark.parametrize(("name", "table", "first"), TABLES, ids=lambda value: str(value)[:6])
def test_the_page_draws_the_table(name: str, table: tuple[Transition, ...], first: str) -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert f"```mermaid\n{drawn(table, first)}\n```" in page
    assert f"\n\n{listed(table)}\n\n" in page


def test_the_page_explains_every_event() -> None:
    page = PAGE.read_text(encoding="utf-8")
    for event, meaning in EVENTS.items():
        assert f"| {event} | {meaning} |" in page


@pytest.mark.parametrize(
    ("sentence", "value"),
    [
        ("a command is sent again after {} ms, or two round trips", RESEND_MS),
        ("is silent for {} ms | everything is released", messages.DEADMAN_MS),
        ("is silent for {:g} s | lost", messages.LOST_MS / 1000),
        ("tries again after {0[0]:g} s, then {0[1]:g}, {0[2]:g}, {0[3]:g}, 2", BACKOFF_S),
        ("commands that are {} ms old", messages.LATE_MS),
        ("forgets a silent host after {:g} s", messages.SILENCE_MS / 1000),
        ("({} requests waiting)", byte_link.REQUESTS),
        ("whose news nobody takes ({:,})", receiver.INBOX),
        ("dropped at {:g} KiB", device_session.BACKLOG / 1024),
        ("made up for within {} ms", messages.HEARTBEAT_MS),
    ],
)
def test_the_page_names_the_limits_that_are_kept(sentence: str, value: object) -> None:
    assert sentence.format(value) in " ".join(PAGE.read_text(encoding="utf-8").split())


@pytest.mark.parametrize(("name", "table", "first"), TABLES, ids=lambda value: str(value)[:6])
def test_every_state_is_reached_and_left(
    name: str, table: tuple[Transition, ...], first: str
) -> None:
    ways = next_states(table)
    reached = {first}
    while more := {to for (at, _), to in ways.items() if at in reached} - reached:
        reached |= more
    assert reached == {state for row in table for state in row.states}
    assert {event for _, event in ways} <= set(EVENTS)


def test_from_everywhere_a_lost_peer_leads_back_to_the_start() -> None:
    device, host = next_states(DEVICE), next_states(HOST)
    for state in ("offered", "live"):
        assert device[state, "silence"] == device[state, "cut"] == "waiting"
    for state in ("greeting", "joining", "live", "stale"):
        assert host[state, "cut"] == "over"
    assert host["greeting", "silence"] == host["joining", "silence"] == "over"
    assert host["live", "gone"] == host["stale", "gone"] == "over"


def test_two_ways_for_one_event_are_a_mistake() -> None:
    with pytest.raises(ValueError, match="two transitions from a on x"):
        next_states((Transition(("a", "b"), "x", "b", ""), Transition(("a",), "x", "a", "")))


@pytest.mark.parametrize(("module", "table"), [(device_session, DEVICE), (host_session, HOST)])
def test_the_sessions_change_their_state_through_the_table_only(
    module: object, table: tuple[Transition, ...]
) -> None:
    source = Path(str(module.__file__)).read_text(encoding="utf-8")  # type: ignore[attr-defined]
    events = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Assign):
            assert "self.state" not in ast.unparse(node.targets[0])
        if isinstance(node, ast.Constant) and node.value in EVENTS:
            events.add(node.value)
    assert {row.event for row in table} <= events, "a way that nothing takes"


def test_the_module_says_what_the_events_are() -> None:
    used = {row.event for table in (DEVICE, HOST) for row in table}
    assert used == set(states.EVENTS)
