"""Pump control: to a pressure, and never beyond limits in pressure and time; pure."""

from typing import Final

from controller.sensors.hardware.wiring import PumpWiring

SLACK: Final = 0.02  # of the target: what the pressure may fall before the pump starts again
_RISES_KPA: Final = 0.03  # what a run of `longest_s` must bring, or something leaks or is blocked
_BELOW_KPA: Final = -0.3  # no orb sucks: the pressure sensor is off
_TIMES: Final = (
    5  # that the pressure is impossible, one after the other, before the pump is given up
)
_RUNS: Final = 3  # without a rise, before the pump is given up


class Pump:
    """Says whether the pump shall run.

    Attributes:
        problem: Why the pump is refused, in words; "" while all is well.
        running: What was last said.
    """

    def __init__(self, wiring: PumpWiring) -> None:
        """Begin with the pump at rest."""
        self.problem, self.running = "", False
        self._wiring = wiring
        self._since_s = 0.0  # when it began to run
        self._from_kpa = 0.0  # where
        self._rests_until_s = float("-inf")
        self._in_vain = self._impossible = 0

    def step(self, now_s: float, kpa: float) -> bool:
        """Return whether the pump shall run, for a pressure; call it often."""
        wiring = self._wiring
        refusal = self._refusal(kpa)
        self._impossible = self._impossible + 1 if refusal else 0
        if self._impossible >= _TIMES:
            self.problem = self.problem or refusal
        if self.problem or refusal or now_s < self._rests_until_s:
            self.running = False
        elif not self.running and kpa < wiring.target_kpa * (1.0 - SLACK):
            self.running, self._since_s, self._from_kpa = True, now_s, kpa
        elif self.running and kpa >= wiring.target_kpa:
            self.running, self._in_vain = False, 0
        elif self.running and now_s - self._since_s >= wiring.longest_s:
            self.running, self._rests_until_s = False, now_s + wiring.rest_s
            self._judge(kpa)
        return self.running

    def _refusal(self, kpa: float) -> str:
        if not kpa <= self._wiring.limit_kpa:
            return (
                f"the orb has {kpa:.2f} kPa, more than its limit of {self._wiring.limit_kpa:g}; "
                "the pump stays off until the controller is started again"
            )
        if kpa < _BELOW_KPA:
            return f"the pressure sensor reads {kpa:.2f} kPa; check its supply, the pump stays off"
        return ""

    def _judge(self, kpa: float) -> None:
        """Give up on a pump that runs in vain."""
        self._in_vain = 0 if kpa - self._from_kpa >= _RISES_KPA else self._in_vain + 1
        if self._in_vain >= _RUNS:
            self.problem = (
                f"the pump ran {_RUNS} times for {self._wiring.longest_s:g} s and the pressure is "
                f"still {kpa:.2f} kPa; look for a leak, a loose hose or a dead pump"
            )


def kilopascals(wiring: PumpWiring, volts: float) -> float:
    """Return the pressure that the sensor's output means."""
    return (volts - wiring.zero_v) / wiring.v_per_kpa
