"""The fuzzers' harnesses on a few hundred inputs; python -m tests.fuzz runs them for hours."""

from __future__ import annotations

from types import ModuleType

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controller.shared.protocol.packets import Decoder, encode
from tests.fuzz import decoder, mapping, session

HARNESSES = (decoder, session, mapping)


@pytest.mark.parametrize("harness", HARNESSES, ids=lambda harness: harness.__name__)
def test_inputs_to_begin_with_hold_what_must_hold(harness: ModuleType) -> None:
    for data in harness.seeds():
        harness.one(data)


def test_stories_to_begin_with_reach_commands_and_losses() -> None:
    told = [session.tell(data).happened for data in session.seeds()]
    # A command; one that is sent again; one that is too old by then; a restart.
    expected = [(1, 1, 0), (2, 2, 0), (1, 0, 1), (0, 0, 0)] * 2
    assert [(one["commands"], one["delivered"], one["missed"]) for one in told] == expected


def test_frames_to_begin_with_are_every_kind_of_message() -> None:
    kinds = set()
    for message in decoder.MESSAGES:
        frame = encode(message, session=1, sequence=1, t_ms=1)
        kinds |= {type(packet.message) for packet in Decoder().feed(frame)}
    assert kinds == {type(message) for message in decoder.MESSAGES}


@settings(deadline=None, max_examples=300)
@given(st.binary(max_size=400))
def test_any_bytes_are_decoded_alike_however_they_are_cut(data: bytes) -> None:
    decoder.one(data)


happenings = st.lists(
    st.one_of(
        st.sampled_from([session.COMMAND, session.wait(20), session.wait(260), session.wait(400)]),
        st.binary(min_size=1, max_size=6),
    ),
    max_size=60,
)


@settings(deadline=None, max_examples=100)
@given(st.sampled_from(list(session.seeds())), happenings)
def test_whatever_the_wire_does_no_command_is_invented_or_doubled(
    beginning: bytes, then: list[bytes]
) -> None:
    session.one(beginning + b"".join(then))


@settings(deadline=None, max_examples=200)
@given(
    st.integers(0, 5),
    st.lists(st.one_of(st.integers(0, len(mapping.WORDS) - 1), st.integers(0, 255)), max_size=80),
)
def test_any_mapping_is_read_or_refused_in_a_sentence(how: int, words: list[int]) -> None:
    mapping.one(bytes([how, *words]))
