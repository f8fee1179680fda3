"""The public interface of OrbTouch: recordings, networks and orbs, in a few lines of Python.

    import orbtouch

    session = orbtouch.simulate(minutes=2)   # or orbtouch.load_recording("session.npz")
    network = orbtouch.load_network()        # the one that ships, or load_network("my.orb")
    print(network.evaluate(session))         # figures with 95 % intervals
    with orbtouch.connect() as orb:          # a virtual orb, or connect("/dev/rfcomm0")
        for command in orb:
            print(command.name, command.gesture)

What is listed in `__all__` keeps its names and meanings; changes are announced in CHANGELOG.md one
minor version ahead. The packages controller, host, models and tetris are the implementation, and
may change at any time. Whatever a user can put right is raised as `Error`, in one sentence.
"""

# What this file imports delays the entry points, in which Ctrl+C prints a trace until they run.
TYPE_CHECKING = False  # as of `typing`, which takes 10 ms
if TYPE_CHECKING:
    from typing import Any, Final

    from controller import __version__ as __version__
    from controller.shared.errors import UserError as Error
    from orbtouch.evaluation import evaluate
    from orbtouch.in_process import live, play
    from orbtouch.networks import Command, Lesson, Network, load_network
    from orbtouch.orbs import Contact, Frame, Orb, Press, Release, connect, record
    from orbtouch.recordings import Recording, import_recordings, load_recording, simulate
    from orbtouch.results import Comparison, Evaluation, compare
    from orbtouch.training import Training, train
    from orbtouch.windows import Windows

__all__ = [
    "Command",
    "Comparison",
    "Contact",
    "Error",
    "Evaluation",
    "Frame",
    "Lesson",
    "Network",
    "Orb",
    "Press",
    "Recording",
    "Release",
    "Training",
    "Windows",
    "compare",
    "connect",
    "evaluate",
    "import_recordings",
    "live",
    "load_network",
    "load_recording",
    "play",
    "record",
    "simulate",
    "train",
]

# Modules of the names: each is imported at its first use: the command
# needs none of them, and looks first whether our other packages are the ones that are found.
_MODULES: "Final" = {
    **dict.fromkeys(("Command", "Lesson", "Network", "load_network"), "networks"),
    **dict.fromkeys(("Contact", "Frame", "Orb", "Press", "Release"), "orbs"),
    **dict.fromkeys(("connect", "record"), "orbs"),
    **dict.fromkeys(("live", "play"), "in_process"),
    **dict.fromkeys(("Recording", "import_recordings"), "recordings"),
    **dict.fromkeys(("load_recording", "simulate"), "recordings"),
    **dict.fromkeys(("Comparison", "Evaluation", "compare"), "results"),
    **dict.fromkeys(("Training", "train"), "training"),
    "Windows": "windows",
    "evaluate": "evaluation",
}


def __getattr__(name: str) -> "Any":
    """Import a public name."""
    from importlib import import_module

    if name == "Error":
        return import_module("controller.shared.errors").UserError
    if name == "__version__":
        return import_module("controller").__version__
    if name not in _MODULES:
        raise AttributeError(f"module 'orbtouch' has no attribute {name!r}")
    return getattr(import_module(f"orbtouch.{_MODULES[name]}"), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
