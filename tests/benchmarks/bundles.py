"""Robustness against changed bundles: mutated by a program, loaded by a device.

    python -m tests.benchmarks.bundles [--count N] [--seed N] [--json]

Each mutation of the shipped bundle, or of one with people in it, is read, walked and proved as
`controller install` does it, half of them with all sums made right again; a child may use 512 MiB
and is killed after 20 s. A mutation counts as accepted when the proof goes through; what is
accepted after it was hashed anew must be a network within the limits: a wrong model at worst.
"""

import multiprocessing
import random
import resource
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Final

from controller.bundles import bundle, container
from controller.bundles.container import BundleError
from controller.bundles.inference import onnx_reader, onnx_shapes
from controller.bundles.inference.networks import Recognizer
from tests.support import user_bundles

from .results import Results, command_line

MEMORY: Final = 512 << 20  # bytes that the child may have beyond what it begins with
DEADLINE_S: Final = 20.0
BATCH: Final = 250  # mutations for one child
SHIPPED: Final = bundle.default_path().read_bytes()

Change = Callable[[random.Random, bytes], bytes]


def with_people() -> bytes:
    """Return a bundle that knows people."""
    with tempfile.TemporaryDirectory() as folder:
        return user_bundles.write(Path(folder) / "people.orb").read_bytes()


WITH_PEOPLE: Final = with_people()


def cut(draw: random.Random, data: bytes) -> bytes:
    return data[: draw.randrange(len(data))]


def flip(draw: random.Random, data: bytes) -> bytes:
    """Turn some bits over."""
    changed = bytearray(data)
    for _ in range(draw.randint(1, 8)):
        changed[draw.randrange(len(data))] ^= 1 << draw.randrange(8)
    return bytes(changed)


def swap(draw: random.Random, data: bytes) -> bytes:
    size = draw.randint(1, min(4096, len(data) // 2))
    one, other = sorted(draw.randrange(len(data) - size) for _ in range(2))
    if other < one + size:
        return data[one:] + data[:one]
    first, second = data[one : one + size], data[other : other + size]
    return data[:one] + second + data[one + size : other] + first + data[other + size :]


def insert(draw: random.Random, data: bytes) -> bytes:
    """Put bytes in, random ones or many of one kind."""
    at = draw.randrange(len(data))
    piece = draw.choice([draw.randbytes(draw.randint(1, 64)), b"\xff" * 9, b"\0" * 4096])
    return data[:at] + piece + data[at:]


def huge(draw: random.Random, data: bytes) -> bytes:
    """Make a number of a protocol buffer as large as it can be, where the operators are."""
    head = data[:4000] if draw.random() < 0.7 else data[-3000:]
    at = draw.randrange(len(head))
    number = draw.choice([b"\xff" * 9 + b"\x01", b"\x80\x80\x80\x80\x10", b"\xc0\x84\x3d", b"\x7f"])
    begin = data.index(head)
    return data[: begin + at] + number + data[begin + at + 1 :]


WHOLE: Final[dict[str, Change]] = {"cut": cut, "flip": flip, "swap": swap, "insert": insert}
PART: Final[dict[str, Change]] = {**WHOLE, "huge number": huge}


def mutation(draw: random.Random) -> tuple[str, bytes]:
    """Return a mutated bundle, and what was done to it."""
    whole = draw.choice([SHIPPED, WITH_PEOPLE])
    if draw.random() < 0.5:
        name = draw.choice(list(WHOLE))
        return name, WHOLE[name](draw, whole)
    parts = container.unpack(whole)
    named = [name for name in parts if name != container.SUMS]
    if draw.random() < 0.1:
        one, other = draw.sample(named[1:], 2)
        parts[one], parts[other] = parts[other], parts[one]
        name = "parts exchanged"
    else:
        name = draw.choice(list(PART))
        part = draw.choice(named)
        parts[part] = PART[name](draw, parts[part])
    parts[container.SUMS] = container._sums(parts)
    return f"{name}, hashed anew", container.pack(parts)


def judge(data: bytes) -> str:
    """Return which of our checks stopped a bundle; "accepted" if none did."""
    try:
        container.unpack(data)
    except BundleError:
        return "container or hash"
    try:
        read = bundle.parse(data)
    except BundleError:
        return "manifest or golden vectors' form"
    try:
        for model in (read.embedding_onnx, read.location_onnx, read.user_onnx):
            if model:
                onnx_shapes.sizes(onnx_reader.read(model))
    except onnx_reader.GraphError:
        return "walk and limits"
    try:
        Recognizer(read)
    except BundleError:
        return "golden answers"
    return "accepted"


def child(first: int, count: int, seed: int, out: Connection) -> None:
    """Judge some mutations, and tell each verdict with its time."""
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    resource.setrlimit(resource.RLIMIT_DATA, (used + MEMORY, used + MEMORY))
    for number in range(first, first + count):
        name, data = mutation(random.Random(seed * 1_000_003 + number))
        start = time.perf_counter()
        verdict = "unchanged" if data in (SHIPPED, WITH_PEOPLE) else judge(data)
        out.send((name, verdict, time.perf_counter() - start))
    out.close()


def measure(count: int, seed: int) -> tuple[Counter[tuple[str, str]], float, int]:
    """Return verdicts by (what was done, what stopped it), the longest time, and lost children."""
    verdicts: Counter[tuple[str, str]] = Counter()
    longest, lost, done = 0.0, 0, 0
    context = multiprocessing.get_context("spawn")
    while done < count:
        here, there = context.Pipe(duplex=False)
        batch = min(BATCH, count - done)
        worker = context.Process(target=child, args=(done, batch, seed, there))
        worker.start()
        there.close()
        taken = 0
        try:
            while taken < batch and here.poll(DEADLINE_S):
                name, verdict, took = here.recv()
                verdicts[name, verdict] += 1
                longest, taken = max(longest, took), taken + 1
        except EOFError:
            pass
        if taken < batch:  # it died, or was too slow, at this one: that is a finding
            lost += 1
            taken += 1
            worker.kill()
        worker.join()
        done += taken
        print(f"\r{done} of {count}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return verdicts, longest, lost


def main() -> None:
    options = command_line(__doc__, count=10_000, seed=1).parse_args()
    verdicts, longest, lost = measure(options.count, options.seed)
    stops = sorted({stop for _, stop in verdicts})
    width = max(len(name) for name, _ in verdicts) + 2
    print(" " * width + "  ".join(stops))
    for name in sorted({name for name, _ in verdicts}):
        cells = (f"{verdicts[name, stop] or '':>{len(stop)}}" for stop in stops)
        print(f"{name:{width}}" + "  ".join(cells))
    accepted = {name: n for (name, stop), n in verdicts.items() if stop == "accepted"}
    anew = sum(n for name, n in accepted.items() if "anew" in name)
    results = Results("bundles")
    results.note("bundles_accepted", sum(accepted.values()) - anew, goal=0)
    results.note("bundles_accepted_hashed_anew", anew)
    results.note("bundles_lost_processes", lost, goal=0)
    results.note("bundles_longest_s", round(longest, 3), "s")
    results.finish(options.json)


if __name__ == "__main__":
    main()
