"""State transition tables of the two ends of a session.

`controller.protocol.device_session` and `controller.protocol.host_session` change their state only
by these tables; docs/link.md draws them. `EVENTS` explains the events.
"""

from collections.abc import Sequence
from typing import Final, NamedTuple

EVENTS: Final = {
    "hello": "Hello came, with a version that both have",
    "foreign": "Hello came, with other versions only",
    "offer": "Offer came, and needs a key exactly if we have one",
    "join": "Join came, sealed with the key if there is one, and this host is accepted",
    "welcome": "Welcome came, sealed with the key if there is one",
    "objection": "the other side is refused: no key, none needed, a wrong token, "
    "another host is connected",
    "forged": "a packet of this session came with a wrong tag",
    "refuse": "Refuse came",
    "packet": "any other valid packet came, of this session, and newer than the last",
    "quiet": "no valid packet for 300 ms",
    "gone": "no valid packet for 1 s; of a grant's answer, for 2 s",
    "silence": "no valid packet for 2 s; in the handshake, 2 s since Hello",
    "bye": "Bye came",
    "cut": "the port was closed, unplugged or flooded",
    "close": "our own program ends",
    "again": "the pause is over (0.25, 0.5, 1, 2, 2 ... s, a quarter more or less), the port open",
}


class Transition(NamedTuple):
    """One row: the states, the event, the next state, and the action in words."""

    states: tuple[str, ...]
    event: str
    to: str
    does: str


DEVICE: Final = (
    Transition(("waiting", "offered", "live"), "hello", "offered",
        "end a live session, answer Offer"),
    Transition(("waiting", "offered", "live"), "foreign", "waiting",
        "answer Refuse: what to update"),
    Transition(("offered",), "join", "live",
        "Welcome, State(()); commands younger than 250 ms are resent to the same host"),
    Transition(("offered",), "objection", "waiting", "answer Refuse: why"),
    Transition(("offered",), "forged", "waiting", "answer Refuse: the key"),
    Transition(("live",), "packet", "live", "take it; what it acknowledges is done"),
    Transition(("offered", "live"), "silence", "waiting", "drop the host, lift its fingers"),
    Transition(("offered", "live"), "bye", "waiting", "drop the host, lift its fingers"),
    Transition(("offered", "live"), "cut", "waiting", "drop the host, lift its fingers"),
)  # fmt: skip

HOST: Final = (
    Transition(("over",), "again", "greeting", "send Hello"),
    Transition(("greeting",), "offer", "joining", "send Join, with the last command received"),
    Transition(("greeting", "joining"), "refuse", "over", "report the orb's reason"),
    Transition(("greeting", "joining"), "objection", "over", "send Bye, report why"),
    Transition(("joining",), "forged", "over", "report that the orb has another key"),
    Transition(("joining",), "welcome", "live", "report Connected, and commands missed meanwhile"),
    Transition(("greeting", "joining"), "silence", "over", "report that no orb answered"),
    Transition(("live", "stale"), "packet", "live", "take it; commands out of a stall are missed"),
    Transition(("live",), "quiet", "stale", "release everything, pause"),
    Transition(("live", "stale"), "gone", "over", "report Lost"),
    Transition(("live", "stale"), "bye", "over", "report Lost, with the orb's reason"),
    Transition(("greeting", "joining", "live", "stale"), "cut", "over", "report Refused or Lost"),
    Transition(("greeting", "joining", "live", "stale"), "close", "over", "send Bye"),
)  # fmt: skip

Next = dict[tuple[str, str], str]


def next_states(table: Sequence[Transition]) -> Next:
    """Return the table as a lookup: (state, event) to the next state.

    Raises:
        ValueError: Two rows contradict each other.
    """
    found: Next = {}
    for row in table:
        for state in row.states:
            if (state, row.event) in found:
                raise ValueError(f"there are two transitions from {state} on {row.event}")
            found[state, row.event] = row.to
    return found
