"""What several rooms' tests share."""

import os
import socket
import sys
import tempfile

import pytest

# What the tests keep from one day to the next is nobody's, and nobody's is what they find.
os.environ["XDG_STATE_HOME"] = tempfile.mkdtemp(prefix="orbtouch-tests-")

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
