"""Several paired hosts, and one orb."""

from hypothesis import given, settings
from hypothesis import strategies as st

from controller.links.bluetooth.hid.hosts import WAIT_S, HostSelection, StoredHosts

LAPTOP, PHONE, TABLET = "AA:00:00:00:00:01", "AA:00:00:00:00:02", "AA:00:00:00:00:03"
TWO = StoredHosts((LAPTOP, PHONE), LAPTOP)


def test_the_first_host_ever_gets_the_orb_and_is_remembered() -> None:
    hosts = HostSelection(StoredHosts())
    hosts.arrive(LAPTOP, 1.0)
    assert (hosts.active, hosts.known) == (LAPTOP, StoredHosts((LAPTOP,), LAPTOP))


def test_the_host_that_had_the_orb_last_is_waited_for() -> None:
    hosts = HostSelection(TWO)
    hosts.arrive(PHONE, 1.0)
    assert (hosts.active, hosts.unwanted()) == ("", [PHONE])
    hosts.leave(PHONE, 1.1)
    hosts.arrive(LAPTOP, 2.0)
    assert (hosts.active, hosts.unwanted()) == (LAPTOP, [])


def test_after_a_while_any_paired_host_will_do() -> None:
    hosts = HostSelection(TWO)
    hosts.arrive(PHONE, WAIT_S - 1)
    assert hosts.due_s == WAIT_S
    hosts.tick(WAIT_S)
    assert (hosts.active, hosts.known.wanted) == (PHONE, PHONE)


def test_a_second_host_never_gets_what_is_pressed_for_the_first() -> None:
    hosts = HostSelection(TWO)
    hosts.arrive(LAPTOP, 1.0)
    hosts.arrive(PHONE, 100.0)
    assert (hosts.active, hosts.unwanted()) == (LAPTOP, [PHONE])


def test_a_host_that_comes_back_gets_the_orb_back() -> None:
    hosts = HostSelection(TWO)
    hosts.arrive(LAPTOP, 1.0)
    hosts.leave(LAPTOP, 50.0)
    assert hosts.active == ""
    hosts.arrive(PHONE, 51.0)
    hosts.arrive(LAPTOP, 52.0)
    assert (hosts.active, hosts.unwanted()) == (LAPTOP, [PHONE])


def test_the_player_changes_hosts_in_turn() -> None:
    hosts = HostSelection(TWO)
    hosts.arrive(LAPTOP, 1.0)
    assert hosts.change(0, 2.0) == f"host 2 of 2, {PHONE}"
    assert (hosts.active, hosts.unwanted()) == ("", [LAPTOP])
    hosts.leave(LAPTOP, 2.1)
    hosts.arrive(PHONE, 3.0)
    assert hosts.active == PHONE
    assert hosts.change(0, 4.0) == f"host 1 of 2, {LAPTOP}"


def test_the_player_names_a_host_by_its_number() -> None:
    hosts = HostSelection(StoredHosts((LAPTOP, PHONE, TABLET), TABLET))
    hosts.change(2, 1.0)
    assert hosts.known.wanted == PHONE
    assert hosts.change(4, 1.0) == "there is no host 4; there are 3"
    assert HostSelection(StoredHosts()).change(0, 1.0) == "there is no host yet; there are 0"


def test_a_wish_for_the_host_that_has_the_orb_changes_nothing() -> None:
    hosts = HostSelection(TWO)
    hosts.arrive(LAPTOP, 1.0)
    hosts.change(1, 2.0)
    assert (hosts.active, hosts.unwanted()) == (LAPTOP, [])


@settings(deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["arrive", "leave", "change", "tick"]),
            st.sampled_from([LAPTOP, PHONE, TABLET]),
            st.floats(0.0, 20.0),
        )
    )
)
def test_at_most_one_host_at_a_time_is_not_sent_away(script: list[tuple[str, str, float]]) -> None:
    hosts, now_s, there = HostSelection(TWO), 0.0, set[str]()
    for what, address, pause_s in script:
        now_s += pause_s
        match what:
            case "arrive":
                there.add(address)
                hosts.arrive(address, now_s)
            case "leave":
                there.discard(address)
                hosts.leave(address, now_s)
            case "change":
                hosts.change(0, now_s)
            case "tick":
                hosts.tick(now_s)
        staying = there - set(hosts.unwanted())
        assert staying == ({hosts.active} if hosts.active else set())
        assert not hosts.active or hosts.known.wanted == hosts.active
