"""Changes of a bundle in a process of low priority, so that the control loop does not wait.

    python -m controller.adapt.process BUNDLE OUT < job

makes one change. It prints lines of JSON: the share that is done, and the outcome as the last one.
The end of its standard input means that its parent has ended, and ends it.
"""

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
import tomli_w

from controller import npz
from controller.adapt import commands, few_shot, lessons
from controller.adapt.examples import Example
from controller.adapt.few_shot import AdaptedBundle, AdaptError, Progress
from controller.bundles import bundle as bundles
from controller.bundles import container
from controller.bundles.container import BundleError
from controller.errors import reason

DEADLINE_S: Final = 120.0
NICE: Final = 10
CHANGES: Final = "changes"  # entry of the card: number of changes since the training
MAX_BYTES: Final = 64 << 20  # of a job
_SIZE: Final = 8  # bytes of its length, before it
_ENV: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True, eq=False)
class Job:
    """One change of a bundle."""

    action: str  # "teach", "learn" (earlier examples go), "forget" or "command"
    label: str = ""
    command: str = ""  # "": nothing
    note: str = ""
    user: str = ""  # whose command; "": everybody's
    examples: tuple[Example, ...] = ()  # with their spans

    def pack(self) -> bytes:
        """Return the job as bytes."""
        words = np.array(
            [self.action, self.label, self.command, self.note, self.user], dtype="U200"
        )
        grid = self.examples[0].images.shape[1:] if self.examples else (1, 1)
        return npz.pack({"words": words, **lessons.pack(self.examples, grid)})

    @classmethod
    def unpack(cls, data: bytes) -> "Job":
        """Return the job in bytes of `pack`."""
        arrays = npz.unpack(data, MAX_BYTES)
        action, label, command, note, user = map(str, arrays["words"])
        return cls(action, label, command, note, user, lessons.unpack(arrays))

    def do(self, data: bytes, progress: Progress) -> AdaptedBundle:
        """Return the changed bundle; AdaptError, BundleError."""
        if self.action == "forget":
            return few_shot.forget(data, self.label, progress)
        if self.action == "command":
            return commands.set_command(data, self.label, self.command, self.user)
        again = self.action == "learn"
        return few_shot.teach(
            data,
            self.examples,
            command=self.command if again else None,
            note=self.note,
            again=again,
            progress=progress,
        )


@dataclass(frozen=True, slots=True)
class Outcome:
    """Outcome of a job."""

    kept: float = 1.0  # as in AdaptedBundle
    recognised: dict[str, float] = field(default_factory=dict)
    waits: tuple[str, ...] = ()  # gestures that wait for a taught one
    patience_s: float = 0.0  # how long


def run(job: Job, path: Path, out: Path, progress: Progress = lambda share: None) -> Outcome:
    """Change a bundle by a process, write the result to `out`, and return the outcome.

    It takes seconds: call this in a thread of its own.

    Raises:
        AdaptError: It is not possible; the message is a sentence.
        OSError: The process cannot be started.
    """
    command = [sys.executable, "-m", "controller.adapt.process", str(path.resolve()), str(out)]
    environment = {**os.environ, **dict.fromkeys(_ENV, "1")}
    with tempfile.TemporaryFile() as errors, subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, env=environment
    ) as process, _deadline(process.kill) as late:  # fmt: skip
        assert process.stdin is not None
        assert process.stdout is not None
        with contextlib.suppress(BrokenPipeError):
            packed = job.pack()
            process.stdin.write(len(packed).to_bytes(_SIZE, "little") + packed)
            process.stdin.flush()
        last = _follow(process.stdout, progress)
        status = process.wait()
        with contextlib.suppress(BrokenPipeError):
            process.stdin.close()
        if late.is_set():
            raise AdaptError(f"it was not learned within {DEADLINE_S:g} s")
        if status or last is None:
            raise AdaptError(_reason(errors, status))
    return Outcome(**last)


@contextlib.contextmanager
def _deadline(kill: Callable[[], None]) -> Iterator[threading.Event]:
    """Call `kill` after the deadline, and set the event."""
    late = threading.Event()

    def end() -> None:
        late.set()
        kill()

    timer = threading.Timer(DEADLINE_S, end)
    timer.start()
    try:
        yield late
    finally:
        timer.cancel()


def _follow(lines: IO[bytes], progress: Progress) -> dict[str, Any] | None:
    """Report the shares in a process's lines; return its outcome, None if there is none."""
    for line in lines:
        value = json.loads(line)
        if isinstance(value, dict):
            return value
        progress(value)
    return None


def _reason(errors: IO[bytes], status: int) -> str:
    """Return the last line of a process's messages."""
    errors.seek(0)
    lines = errors.read().decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else f"learning ended with status {status}"


def _end_with(pipe: int) -> None:
    """End the process when the other end of a pipe is closed."""
    while os.read(pipe, _SIZE):
        pass
    os._exit(1)


def counted(manifest: bytes) -> bytes:
    """Return a manifest whose card counts one more change, so that no two in a row are equal."""
    table = container.manifest(manifest)
    before = table["card"].get(CHANGES, 0)
    table["card"][CHANGES] = before + 1 if isinstance(before, int) else 1
    return tomli_w.dumps(table).encode()


def main(argv: list[str]) -> int:
    """Do the job on standard input: BUNDLE OUT."""
    path, out = map(Path, argv)
    if hasattr(os, "nice"):
        os.nice(NICE)
    size = int.from_bytes(sys.stdin.buffer.read(_SIZE), "little")
    job = Job.unpack(sys.stdin.buffer.read(size))
    threading.Thread(target=_end_with, args=(sys.stdin.fileno(),), daemon=True).start()
    try:
        made = job.do(path.read_bytes(), lambda share: print(round(share, 3), flush=True))
        bundles.write(out, manifest=counted(made.manifest), parts=made.parts)
    except (AdaptError, BundleError) as error:
        print(error, file=sys.stderr)
        return 1
    except OSError as error:
        print(f"the orb cannot keep it: {reason(error)}", file=sys.stderr)
        return 1
    debounce = made.debounce
    outcome = Outcome(made.kept, dict(made.recognised), debounce.patient, debounce.patience_s)
    print(json.dumps(asdict(outcome)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
