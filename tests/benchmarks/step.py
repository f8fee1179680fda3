"""Cost of a control step: the networks, the paced step, and the start.

    python -m tests.benchmarks.step [--calls N] [--seconds S] [--json]

`inference_ratio_ort` and `inference_ratio_torch`: median of the shipped gesture network over that
of the paper's network (its widths, not trained: 1,047,000 weights at 10 Hz) in ONNX
Runtime and in PyTorch as it comes. All run interleaved, one thread, on windows of a real stream
that slide as they do on the device. Peers that are not installed are reported as missing.

`step`: frame in, packet out into a pipe, on an absolute schedule at 10 and 100 frames a second.
`startup`: from the start of the process until it has printed a first command, over `import
onnxruntime` alone, interleaved, from bytecode, and the resident memory then. The session begins
with its rest known and a hand on the orb. `startup_cpu_ratio` says the same on a busy machine.
"""

import gc
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

from controller.shared.aliases import Array

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

from controller.bundles import bundle as bundles
from controller.bundles.bundle import Bundle
from controller.bundles.inference import onnxruntime_engine
from controller.bundles.inference.networks import Recognizer, gestures_of
from controller.bundles.inference.onnxruntime_engine import Network
from controller.recognition.images.frames import Window
from controller.recognition.images.preprocess import Preprocessor
from controller.recognition.pipeline import Pipeline
from controller.recordings import reader, writer
from controller.recordings.recording import LABELLERS, Recording
from controller.runtime.device import telemetry
from controller.shared.protocol.messages import NumberedCommand
from controller.shared.protocol.packets import encode
from tests.support.processes import memory_mib

from .results import Results, command_line

if TYPE_CHECKING:
    from models.training.networks import Network as Layers

DEMO: Final = Path(str(files("assets") / "demo.npz"))
ROUND: Final = 1000  # calls of one peer before the next has its turn
STARTS: Final = 21
COLUMNS: Final = ("frames", "t", "sequence", *LABELLERS, "excluded", "touch")  # one row a frame
GOALS: Final = {
    "inference_ratio_ort": 0.15,
    "inference_ratio_torch": 0.12,
    "step_p99_ms": 1.0,
    "startup_ratio": 2.2,
    "rss_mb": 70.0,
}


def stream(bundle: Bundle) -> list[Window]:
    """Return the windows of a recorded session, one a frame."""
    preprocessor = Preprocessor(bundle.preprocess, bundle.rows, bundle.columns)
    windows = []
    for frame in reader.load(DEMO).frames:
        preprocessor.step(frame)
        if (window := preprocessor.window()) is not None:
            windows.append(window[None])
    return windows


def networks(shipped: Bundle) -> dict[str, Network | str]:
    """Return every network that is timed, by name; text says why one is missing."""
    out: dict[str, Network | str] = {"shipped": gestures_of(shipped)}
    missing = "missing: PyTorch, the [train] extra"
    if find_spec("torch") is None:
        return out | dict.fromkeys(("shipped@torch", "paper", "paper@torch"), missing)
    import torch

    from models.data.recipe import DEFAULT, PAPER
    from models.training import export, transfer
    from models.training.networks import gesture_net

    torch.set_num_threads(1)
    torch.manual_seed(0)
    shape, classes = (shipped.window, shipped.rows, shipped.columns), len(shipped.labels)
    ours = gesture_net(shape, classes, replace(DEFAULT.gesture, normalised=False))
    state = transfer.state_of(shipped.embedding_onnx, shipped.head)
    ours.load_state_dict({key: state[key] for key in ours.state_dict()})
    paper = gesture_net(shape, classes, PAPER.gesture).folded()
    file = export.onnx_file(paper, shape, "windows", "logits", classes)
    peers = {"shipped@torch": _torch(ours), "paper": onnxruntime_engine.network(file)}
    return {**out, **peers, "paper@torch": _torch(paper)}


def _torch(net: "Layers") -> Network:
    """Return a network in PyTorch as it comes."""
    import torch

    net.eval()

    def run(window: NDArray[np.float32]) -> NDArray[np.float32]:
        with torch.no_grad():
            answer = torch.softmax(net(torch.from_numpy(window)), dim=1)
        return np.asarray(answer.numpy())

    return run


def interleaved(
    peers: dict[str, Network | str], windows: list[Window], calls: int
) -> dict[str, Array | str]:
    """Return the microseconds of each call, peer by peer, in rounds that take turns."""
    times: dict[str, list[Array]] = {name: [] for name, peer in peers.items() if callable(peer)}
    for start in range(0, calls, ROUND):
        for name, kept in times.items():
            run = peers[name]
            assert callable(run)
            taken = np.empty(ROUND)
            for i in range(ROUND):
                window = windows[(start + i) % len(windows)]
                begin = time.perf_counter_ns()
                run(window)
                taken[i] = time.perf_counter_ns() - begin
            kept.append(taken / 1000.0)
    return {
        name: np.concatenate(times[name]) if name in times else str(peer)
        for name, peer in peers.items()
    }


def paced(bundle: Bundle, rate_hz: float, seconds: float) -> Array:
    """Return the milliseconds of each control step on a schedule, the packet in a pipe included."""
    pipeline = Pipeline(bundle.settings, Recognizer(bundle), bundle.mapping)
    frames = reader.load(DEMO).frames
    out, into = os.pipe()
    count = round(seconds * rate_hz)
    times = np.empty(count)
    for number in range(len(frames) // 4):
        pipeline.step(frames[number], number / bundle.rate_hz)
    gc.freeze()  # as the device does
    origin = time.perf_counter()
    for number in range(count):
        due = origin + number / rate_hz
        if (wait := due - time.perf_counter()) > 0:
            time.sleep(wait)
        frame = frames[number % len(frames)]
        begin = time.perf_counter_ns()
        step = pipeline.step(frame, number / bundle.rate_hz)
        data = encode(telemetry(step, rate_hz), session=1, sequence=number & 0xFFFF, t_ms=number)
        if step.command is not None:
            c = step.command
            said = (c.command, c.gesture, c.probability, c.touch, c.frame)
            command = NumberedCommand(*said, number, number, number)
            data += encode(command, session=1, sequence=number & 0xFFFF, t_ms=number)
        os.write(into, data)
        times[number] = time.perf_counter_ns() - begin
        os.read(out, 1 << 16)
        pipeline.check_health()  # as the device does when the packet is out
    gc.unfreeze()
    os.close(out)
    os.close(into)
    return times / 1e6


@dataclass(frozen=True)
class Start:
    """A program until its first line."""

    seconds: float
    cpu_s: float
    resident_mb: float


def starts(bundle: Bundle) -> dict[str, list[Start]]:
    """Return how `controller` starts, and `import onnxruntime` alone, in turns."""
    alone = "import onnxruntime; print(1, flush=True)"
    programs = {"import": [sys.executable, "-c", alone]}
    with tempfile.TemporaryDirectory() as folder:
        session = Path(folder, "session.npz")
        session.write_bytes(writer.pack(about_to_command(bundle)))
        replay = ("--replay", str(session))
        programs["controller"] = [sys.executable, "-m", "controller", *replay]
        taken: dict[str, list[Start]] = {name: [] for name in programs}
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": folder, "ORT_DISABLE_TELEMETRY": "1"}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        for number in range(STARTS + 1):
            for name, command in programs.items():
                start = _first_line(command, environment)
                if number:  # the first writes the bytecode
                    taken[name].append(start)
    return taken


def about_to_command(bundle: Bundle) -> Recording:
    """Return a session whose second frame gives a command."""
    demo = reader.load(DEMO)
    pipeline = Pipeline(bundle.settings, Recognizer(bundle), bundle.mapping)
    states = []
    for number, frame in enumerate(demo.frames):
        states.append(pipeline.state())
        if pipeline.step(frame, float(demo.t[number])).command is not None:
            break
    part = slice(number - 1, number + 1)
    columns = {name: getattr(demo, name)[part] for name in COLUMNS}
    return replace(
        demo, **columns, state=states[-2], marks=(), commands=(), truth=None,
        origin=replace(demo.origin, bundle=bundle.hash),
    )  # fmt: skip


def _first_line(command: list[str], environment: dict[str, str]) -> Start:
    """Return what a program took to its first line."""
    begin = time.perf_counter()
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=0, env=environment
    ) as program:
        assert program.stdout is not None
        program.stdout.readline()
        seconds = time.perf_counter() - begin
        cpu_s = resident_mb = float("nan")
        about = Path(f"/proc/{program.pid}")
        if about.exists():
            resident_mb = memory_mib(pid=program.pid)
            threads = about.glob("task/*/schedstat")  # nanoseconds
            cpu_s = sum(int(file.read_text().split()[0]) for file in threads) / 1e9
        program.kill()
    return Start(seconds, cpu_s, resident_mb)


def main() -> None:
    arguments = command_line(__doc__, calls=20_000, seconds=60.0).parse_args()
    usual = bundles.read(bundles.default_path())
    shipped = bundles.read(bundles.default_path(10.0))  # as the paper's network and the demo
    results = Results("step")

    def report(name: str, value: float | str, unit: str) -> None:
        results.note(name, value, unit, goal=GOALS.get(name.partition("@")[0]))

    timed = interleaved(networks(shipped), stream(shipped), arguments.calls)
    medians: dict[str, float] = {}
    for name, times in timed.items():
        if isinstance(times, str):
            print(f"{name:24}  {times}")
            continue
        medians[name] = float(np.median(times))
        for label, share in (("p50", 50), ("p99", 99), ("p999", 99.9)):
            value = float(np.percentile(times, share))
            results.note(f"inference_{label}@{name}", value, "us")
    ours = medians["shipped"]
    for name, peer in (("ort", "paper"), ("torch", "paper@torch")):
        known = peer in medians
        report(f"inference_ratio_{name}", ours / medians[peer] if known else "missing", "")
    tail_ratio = float(np.percentile(_times(timed["shipped"]), 99)) / ours
    report("inference_p99_over_p50", tail_ratio, "")
    for rate_hz in (10.0, 40.0, 100.0):
        paced_bundle = shipped if rate_hz == shipped.rate_hz else usual
        steps = paced(paced_bundle, rate_hz, arguments.seconds)
        for label, share in (("p99", 99), ("p50", 50), ("p999", 99.9)):
            report(f"step_{label}_ms@{rate_hz:g}Hz", float(np.percentile(steps, share)), "ms")
    started = starts(shipped)
    alone, ours_started = started["import"], started["controller"]
    ours, theirs = _median(ours_started, "seconds"), _median(alone, "seconds")
    report("startup_s", ours, "s")
    report("startup_ratio", ours / theirs, "")
    ours, theirs = _median(ours_started, "cpu_s"), _median(alone, "cpu_s")
    report("startup_cpu_ratio", ours / theirs, "")
    report("rss_mb", _median(ours_started, "resident_mb"), "MB")
    results.finish(arguments.json)


def _median(taken: list[Start], name: str) -> float:
    return float(np.median([getattr(start, name) for start in taken]))


def _times(times: Array | str) -> Array:
    assert not isinstance(times, str)
    return times


if __name__ == "__main__":
    main()
