"""Keys held by the messages of the control loop, for HID over Bluetooth and USB."""

from typing import Final

from controller.shared.keymap.key_state import KeyState
from controller.shared.keymap.keymap import KeyMap
from controller.shared.protocol.messages import Command, Message, State, Telemetry, hold_ms

GAP_S: Final = 0.02  # between two taps of one key: more than a frame of a game at 60 Hz


def key_state(key_map: KeyMap, rate_hz: float) -> KeyState:
    """Return the state of a HID device's keys, which are armed from the beginning.

    A control loop that sends no frames, `rate_hz` a second, holds nothing.
    """
    return KeyState(key_map, armed=True, gap_s=GAP_S, silence_s=hold_ms(rate_hz) / 1000)


def follow(keys: KeyState, message: Message, now_s: float) -> None:
    """Press or release keys by a message of the device: Command, State or Telemetry."""
    match message:
        case Command(name=name):
            keys.command(name, now_s)
        case State(pressed=pressed):
            keys.state(pressed, now_s)
        case Telemetry(gesture=""):
            keys.state((), now_s)
        case Telemetry():
            keys.still_held(now_s)
