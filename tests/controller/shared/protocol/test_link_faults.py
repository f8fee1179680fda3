"""Commands arrive once and in order or are reported, and no key stays down, whatever the wire does.

`python -m tests.benchmarks.link_faults` runs the same for 100,000 steps.
"""

from hypothesis import HealthCheck, settings

from tests.support.link_simulator import TICK_MS, World
from tests.support.link_state_machine import BadWire

TestBadWire = BadWire.TestCase
TestBadWire.settings = settings(
    max_examples=25,
    stateful_step_count=40,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow],
)


def test_a_good_wire_loses_nothing_and_is_quick() -> None:
    for serial in (False, True):
        world = World(serial=serial, keyed=serial, device_ms=5)
        world.wait(200)
        for _ in range(100):
            world.command()
            world.wait(30)
        world.settle()
        assert world.happened["delivered"] == 100
        assert world.happened["missed"] == world.happened["lost"] == world.happened["stale"] == 0
        assert world.oldest_ms <= 2 * TICK_MS  # a wait for the next tick at each end
