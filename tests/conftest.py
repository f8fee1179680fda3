"""What several rooms' tests share."""

import os
import socket
import sys
import tempfile

import hypothesis
import pytest

# No test sees what the person who runs it has installed and saved, nor leaves anything there.
_HOME = tempfile.TemporaryDirectory(prefix="orbtouch-tests-")
for _folder in ("XDG_DATA_HOME", "XDG_CONFIG_HOME", "XDG_STATE_HOME"):
    os.environ[_folder] = os.path.join(_HOME.name, _folder[4:-5].lower())  # noqa: PTH118

# A machine that is busy, or emulated, is no finding.
hypothesis.settings.register_profile("orbtouch", deadline=None)
hypothesis.settings.load_profile("orbtouch")

if sys.platform == "win32":  # these play with ptys and signals, which Windows has none of
    collect_ignore = [
        "test_controller_cli.py",
        "test_links.py",
        "test_receiver.py",
        "test_whole_path.py",
    ]


@pytest.fixture
def free_port() -> int:
    """A TCP port on loopback that nobody listens to."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
