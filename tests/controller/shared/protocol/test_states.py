"""The tables of states: complete, reachable, the only way from state to state, and as drawn."""

import ast
from pathlib import Path

import pytest

from controller.links import byte_link
from controller.shared.protocol import device_session, messages
from controller.shared.protocol import host_session as host_session
from controller.shared.protocol.link_events import BACKOFF_S
from controller.shared.protocol.retransmit import RESEND_MS
from controller.shared.protocol.states import DEVICE, HOST
from host.connection import receiver
from tests.support import ROOT

PAGE = (ROOT / "docs" / "link.md").read_text(encoding="utf-8")
TABLES = [(DEVICE, "waiting"), (HOST, "over")]
Table = dict[tuple[str, str], str]


def drawn(table: Table, first: str) -> str:
    """Return a table as a state diagram, in Mermaid's words."""
    lines = ["stateDiagram-v2", f"    [*] --> {first}"]
    arrows: dict[tuple[str, str], list[str]] = {}
    for (state, event), to in table.items():
        arrows.setdefault((state, to), []).append(event)
    lines += [f"    {at} --> {to}: {', '.join(events)}" for (at, to), events in arrows.items()]
    return "\n".join(lines)


@pytest.mark.parametrize(("table", "first"), TABLES)
def test_the_page_draws_the_table_and_explains_every_event(table: Table, first: str) -> None:
    assert f"```mermaid\n{drawn(table, first)}\n```" in PAGE
    rows = {tuple(row.split(" | ")[:3]) for row in PAGE.splitlines()}
    for event, to in {(event, to) for (_, event), to in table.items()}:
        states = [at for (at, other), _ in table.items() if other == event]
        assert (f"| {', '.join(states)}", event, to) in rows
        assert f"\n| {event} | " in PAGE


@pytest.mark.parametrize(
    ("sentence", "value"),
    [
        ("a command is sent again after {} ms, or two round trips", RESEND_MS),
        ("is silent for {} ms | everything is released", messages.DEADMAN_MS),
        ("gave no sign for {} ms, or three frame periods", messages.DEADMAN_MS),
        ("gave no sign for {:g} s", messages.HUNG_MS / 1000),
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
    assert sentence.format(value) in " ".join(PAGE.split())


@pytest.mark.parametrize(("table", "first"), TABLES)
def test_every_state_is_reached_and_left(table: Table, first: str) -> None:
    reached = {first}
    while more := {to for (at, _), to in table.items() if at in reached} - reached:
        reached |= more
    assert reached == {at for at, _ in table}


def test_from_everywhere_a_lost_peer_leads_back_to_the_start() -> None:
    for state in ("offered", "live", "stalled", "hung"):
        assert DEVICE[state, "silence"] == DEVICE[state, "cut"] == "waiting"
    for state in ("greeting", "joining", "live", "stale"):
        assert HOST[state, "cut"] == "over"
    assert HOST["greeting", "silence"] == HOST["joining", "silence"] == "over"
    assert HOST["live", "gone"] == HOST["stale", "gone"] == "over"


@pytest.mark.parametrize(("module", "table"), [(device_session, DEVICE), (host_session, HOST)])
def test_sessions_change_their_state_through_the_table_only(module: object, table: Table) -> None:
    source = Path(str(module.__file__)).read_text(encoding="utf-8")  # type: ignore[attr-defined]
    words = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Assign):
            assert "self.state" not in ast.unparse(node.targets[0])
        if isinstance(node, ast.Constant):
            words.add(node.value)
    assert {event for _, event in table} <= words, "a way that nothing takes"
