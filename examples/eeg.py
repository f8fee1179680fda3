"""Gestures beside EEG through Lab Streaming Layer: cut an epoch around each command.

Start `host --tap lsl`, and an EEG amplifier's LSL program; then `python eeg.py 20`. Play in the
window for these 20 s. Epochs (commands, samples, channels) go from 0.5 s before to 1 s after each
command, and are saved in epochs.npz.
"""

import sys
import time

import numpy as np
import pylsl

BEFORE_S, AFTER_S = 0.5, 1.0


def inlet(prop: str, value: str) -> pylsl.StreamInlet:
    """Return the first stream with a property; SystemExit if none appears within 10 s."""
    found = pylsl.resolve_byprop(prop, value, timeout=10.0)
    if not found:
        sys.exit(f"no stream with {prop} {value!r} in 10 s; start its program first")
    return pylsl.StreamInlet(found[0], processing_flags=pylsl.proc_clocksync)


def epochs(
    eeg: np.ndarray, t: np.ndarray, events: np.ndarray, rate_hz: float
) -> tuple[np.ndarray, np.ndarray]:
    """Cut epochs out of samples.

    Args:
        eeg: Samples, (n, channels).
        t: Their times, (n,), seconds.
        events: Times of the commands, (m,), seconds.
        rate_hz: Samples per second.

    Returns:
        Epochs, (k, samples, channels), of the k events that lie wholly inside, and which they are.
    """
    before, after = round(BEFORE_S * rate_hz), round(AFTER_S * rate_hz)
    at = np.searchsorted(t, events)
    whole = (at >= before) & (at + after <= len(t))
    cut = [eeg[i - before : i + after] for i in at[whole]]
    shape = (0, before + after, eeg.shape[1])
    return np.stack(cut) if cut else np.empty(shape), np.flatnonzero(whole)


def main(seconds: float = 20.0, path: str = "epochs.npz") -> None:
    """Collect from both streams, and save the epochs with their commands."""
    signal, marks = inlet("type", "EEG"), inlet("name", "OrbTouch commands")
    rate_hz = signal.info().nominal_srate()
    samples, times, commands, events = [], [], [], []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        chunk, stamps = signal.pull_chunk(timeout=0.1)
        samples += chunk
        times += stamps
        chunk, stamps = marks.pull_chunk(timeout=0.0)
        commands += [command for command, gesture in chunk]
        events += stamps
    if not samples:
        sys.exit(f"the amplifier sent no sample in {seconds:g} s; start its recording first")
    cut, kept = epochs(np.array(samples), np.array(times), np.array(events), rate_hz)
    np.savez(path, epochs=cut, commands=np.array(commands)[kept], rate_hz=rate_hz)
    print(f"{len(cut)} epochs of {len(commands)} commands in {path}")


if __name__ == "__main__":
    main(*map(float, sys.argv[1:2]))
