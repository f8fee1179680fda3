"""Fixtures and settings that all tests share."""

import signal
import socket
import sys
from collections.abc import Iterator

import hypothesis
import pytest

# A machine that is busy, or emulated, is no finding.
hypothesis.settings.register_profile("orbtouch", deadline=None)
# The same examples each time, and a failing one is not made smaller.
hypothesis.settings.register_profile(
    "mutants",
    deadline=None,
    derandomize=True,
    phases=(hypothesis.Phase.explicit, hypothesis.Phase.generate),
)
hypothesis.settings.load_profile("orbtouch")

# A run in the background ignores these, and the programs that it starts would, too.
signal.signal(signal.SIGINT, signal.default_int_handler)
if sys.platform != "win32":
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

if sys.platform == "win32":  # these play with ptys and signals, which Windows has none of
    collect_ignore = [
        "controller/cli/test_run.py",
        "controller/links/test_links.py",
        "host/connection/test_receiver.py",
        "host/test_whole_path.py",
    ]


@pytest.fixture(autouse=True, scope="session")
def settings_of_nobody(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What tests let programs remember is not the user's (where XDG's folders count)."""
    with pytest.MonkeyPatch.context() as patch:
        for kind in ("config", "data", "state"):
            patch.setenv(f"XDG_{kind.upper()}_HOME", str(tmp_path_factory.mktemp(kind)))
        yield


@pytest.fixture
def free_port() -> int:
    """A TCP port on loopback that nobody listens to."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
