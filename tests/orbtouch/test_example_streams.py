"""Examples beside other programs: an interactive learner over OSC, and EEG over LSL."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support import fake_device
from tests.support.examples import EXAMPLES, example
from tests.support.processes import LineProcess


def test_the_nearest_neighbour_learns_two_names() -> None:
    pytest.importorskip("pythonosc")
    learner = example("nearest_neighbour").Learner()
    assert learner.hear(np.zeros(25)) == ""
    for name, place in (("rest", 0), ("corner", 24)):
        learner.teach(name)
        for _ in range(40):
            learner.hear(np.eye(25)[place])
    near = np.eye(25)[24] * 0.8
    assert learner.hear(near) == "corner"
    assert len(learner.names) == 80  # no more are taken unasked


def test_epochs_lie_around_the_commands() -> None:
    pytest.importorskip("pylsl")
    eeg = example("eeg")
    t = np.arange(0.0, 10.0, 0.01)
    samples = np.stack([t, -t], axis=1)
    cut, kept = eeg.epochs(samples, t, np.array([0.2, 4.0, 9.5]), 100.0)
    assert kept.tolist() == [1]  # the others do not lie wholly inside
    assert cut.shape == (1, 150, 2)
    assert cut[0, 0, 0] == pytest.approx(3.5)
    assert cut[0, 50, 0] == pytest.approx(4.0)


AMPLIFIER = """
import time, pylsl
outlet = pylsl.StreamOutlet(pylsl.StreamInfo("amplifier", "EEG", 4, 250.0, "float32", "eeg-1"))
began_s, sent = time.monotonic(), 0
while True:
    due = int((time.monotonic() - began_s) * 250)
    if due > sent:
        outlet.push_chunk([[float(number)] * 4 for number in range(sent, due)])
        sent = due
    time.sleep(0.01)
"""
LOOPBACK = """
[multicast]
ResolveScope = machine
ListenAddress = 127.0.0.1
[ports]
IPv6 = disable
"""


@pytest.mark.system
def test_epochs_are_collected_from_two_streams(tmp_path: Path) -> None:
    """An amplifier, an orb with a command in every tenth frame, `host --tap lsl`, the example."""
    pytest.importorskip("pylsl")
    (tmp_path / "lsl.cfg").write_text(LOOPBACK)
    there: dict[str, Any] = {
        "cwd": tmp_path, "env": os.environ | {"LSLAPICFG": str(tmp_path / "lsl.cfg")}
    }  # fmt: skip
    orb = LineProcess((sys.executable, fake_device.__file__, "listen://127.0.0.1:0"))
    url = json.loads(orb.line())["listening"].replace("listen:", "socket:")
    tap = [sys.executable, "-m", "host", "--headless", "--seconds", "60", "--link", url]
    host = subprocess.Popen([*tap, "--tap", "lsl"])
    amplifier = subprocess.Popen([sys.executable, "-c", AMPLIFIER], **there)
    try:
        command = [sys.executable, str(EXAMPLES / "eeg.py"), "4"]
        done = subprocess.run(command, **there, capture_output=True, text=True, timeout=60)
    finally:
        for process in (amplifier, host):
            process.terminate()
            process.wait()
        orb.close()
    assert done.returncode == 0, done.stderr
    with np.load(tmp_path / "epochs.npz") as saved:
        assert len(saved["epochs"]) > 5  # of 20 commands in 4 s, those with 1.5 s of EEG around
        assert saved["epochs"].shape[1:] == (375, 4)
        assert set(saved["commands"]) == {"drop"}
        steps = np.diff(saved["epochs"][:, 0, 0])  # samples between two commands, 0.2 s apart
    assert steps.mean() == pytest.approx(50.0, abs=5.0)
