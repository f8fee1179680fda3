"""Read recordings in processes that get little memory and time, and say what became of each.

    python tests/support/bounded_reader.py MIB SECONDS FILE...

Prints a JSON line for each file: what `survey` and `load` said, the most memory that the process
gained (MiB), and its CPU time (s). A process that asks for more memory than MIB gets none, and one
that takes more than SECONDS of CPU time is killed.
"""

import json
import os
import resource
import sys
from pathlib import Path
from typing import Any

from controller.recordings import reader
from controller.recordings.recording import RecordingError


def attempt(path: Path) -> list[str]:
    """What the two ways of reading say: a refusal's sentence, or "accepted"."""
    said = []
    for read in (reader.survey, reader.load):
        try:
            read(path)
            said.append("accepted")
        except RecordingError as error:
            said.append(str(error))
    return said


def confined(path: Path, mib: int, seconds: int) -> dict[str, Any]:
    """What becomes of one file in a process of its own."""
    inside, outside = os.pipe()
    child = os.fork()
    if not child:
        before = _status("VmRSS")
        try:
            size = _status("VmSize") + (mib << 20)
            resource.setrlimit(resource.RLIMIT_AS, (size, size))
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
            said = attempt(path)
        except BaseException as error:  # whatever it is, the test shall show it
            said = [repr(error)]
        gained = (_status("VmHWM") - before) / (1 << 20)
        os.write(outside, json.dumps({"said": said, "mib": gained}).encode())
        os._exit(0)
    os.close(outside)
    with os.fdopen(inside) as pipe:
        words = pipe.read()
    _, status, used = os.wait4(child, 0)
    result = json.loads(words) if words else {"said": [f"killed, status {status}"], "mib": mib}
    return {**result, "cpu_s": used.ru_utime + used.ru_stime}


def _status(field: str) -> int:
    """One of the sizes that Linux knows of this process, bytes."""
    for line in Path("/proc/self/status").read_text(encoding="ascii").splitlines():
        if line.startswith(f"{field}:"):
            return int(line.split()[1]) * 1024
    raise LookupError(field)


if __name__ == "__main__":
    _mib, _seconds, *_paths = sys.argv[1:]
    for _path in _paths:
        print(json.dumps(confined(Path(_path), int(_mib), int(_seconds))), flush=True)
