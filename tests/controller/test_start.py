import os
import subprocess
import sys
from importlib.resources import files

# What a plain run does without: what is large, of ours and of libraries.
SPARED = "controller.diagnostics controller.simulator controller.teach serial"
PROGRAM = """
import sys
from controller.__main__ import main
status = main(sys.argv[1:])
print("\\n".join(sys.modules), file=sys.stderr)
sys.exit(status)
"""


def imported(*words: str) -> set[str]:
    """Return the modules that a run of `controller` has imported by its end."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words],
        capture_output=True, text=True, check=True, env={**os.environ, "PYTHONWARNINGS": "error"},
    )  # fmt: skip
    return set(done.stderr.split())


def test_plain_run_imports_nothing_that_it_was_not_asked_for() -> None:
    demo = str(files("assets") / "demo.npz")
    plain = imported("--replay", demo)
    assert {"controller.cli.run", "controller.recognition.pipeline", "numpy"} <= plain
    assert not plain.intersection(SPARED.split())


def test_command_imports_nothing_of_a_run() -> None:
    assert not imported("install").intersection({"controller.cli.run", "controller.runtime.loop"})


def test_numpy_keeps_to_one_thread_unless_somebody_says_otherwise() -> None:
    program = "import os; " + PROGRAM.replace("sys.modules", "[os.environ['OPENBLAS_NUM_THREADS']]")
    plain = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    for environment, expected in ((plain, "1"), ({**plain, "OPENBLAS_NUM_THREADS": "4"}, "4")):
        done = subprocess.run(
            [sys.executable, "-c", program, "install"],
            capture_output=True, text=True, check=True, env=environment,
        )  # fmt: skip
        assert done.stderr.split() == [expected]
