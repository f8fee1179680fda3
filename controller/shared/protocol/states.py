"""State transitions of the two ends of a session: (state, event) to the next state.

`device_session` and `host_session` change their state only by these tables. docs/link.md draws
them, explains the events, and says what each transition does.
"""

from typing import Final

# States, event, next state.
_DEVICE: Final = (
    ("waiting offered live stalled hung", "hello", "offered"),
    ("waiting offered live stalled hung", "foreign", "waiting"),
    ("offered", "join", "live"),
    ("offered", "objection", "waiting"),
    ("offered", "forged", "waiting"),
    ("live", "pause", "stalled"),
    ("stalled", "hang", "hung"),
    ("stalled hung", "sign", "live"),
    ("offered live stalled hung", "silence", "waiting"),
    ("offered live stalled hung", "bye", "waiting"),
    ("offered live stalled hung", "cut", "waiting"),
)
_HOST: Final = (
    ("over", "again", "greeting"),
    ("greeting", "offer", "joining"),
    ("greeting joining", "refuse", "over"),
    ("greeting joining", "objection", "over"),
    ("joining", "forged", "over"),
    ("joining", "welcome", "live"),
    ("greeting joining", "silence", "over"),
    ("live stale", "packet", "live"),
    ("live", "quiet", "stale"),
    ("live stale", "gone", "over"),
    ("live stale", "bye", "over"),
    ("greeting joining live stale", "cut", "over"),
    ("greeting joining live stale", "close", "over"),
)
DEVICE: Final = {(at, event): to for states, event, to in _DEVICE for at in states.split()}
HOST: Final = {(at, event): to for states, event, to in _HOST for at in states.split()}
