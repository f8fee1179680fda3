"""Limits, timeouts and thresholds at their agreed values: a slip of one digit is noticed.

Other tests take them from the code, or set others to be quick. The values come from documents, from
the other end of a link and from measurements. To change one, change it here, too.
"""

import importlib

import pytest

VALUES = """
controller/bundles/deploy/store.py: KEEP=8 _MAX_MESSAGE=200
controller/shared/config.py: MAX_BYTES=65536 MAX_PARTS=16 MAX_NESTING=16
controller/shared/config.py: _ANY_NUMBER=(0.0,1000000000.0)
controller/shared/files.py: _PIECE=1048576
controller/shared/keymap/key_state.py: SILENCE_S=1.0 LETTER_S=0.012
controller/links/listen.py: SEND_BUFFER=32768 PEERS=8
controller/shared/npz.py: MAX_DIRECTORY=131072 MAX_MEMBERS=256 MAX_HEADER=4096 MAX_DIMENSIONS=8
controller/shared/npz.py: _LOCATOR=20 _LOCAL_HEADER=30 _FLAGS=2062 _RATIO=1032
controller/shared/protocol/auth.py: SIZE=8 NONCE=16
controller/shared/protocol/device_session.py: BACKLOG=16384 GRANTED_BACKLOG=4194304
controller/shared/protocol/messages.py: VERSION=3 MAX_PAYLOAD=1024 MAX_TEXT=64
controller/shared/protocol/messages.py: MAX_SENTENCE=500 PIECE=1000
controller/shared/protocol/messages.py: HEARTBEAT_MS=100 DEADMAN_MS=300 LOST_MS=1000 LOOP_FRAMES=3
controller/shared/protocol/messages.py: HUNG_MS=1000 SILENCE_MS=2000 LATE_MS=250
controller/shared/protocol/packets.py: SEALED=4 _INCOMPATIBLE=12 MAX_FRAME=1051 EVERY_VERSION=(1,3)
controller/shared/protocol/packets.py: NEVER=4294967295 _WINDOW=32 _LONGEST_MS=10000 _GRAIN_MS=2
controller/shared/protocol/retransmit.py: RESEND_MS=50 MOST=32
controller/recognition/user_id.py: NOT_ENROLLED=0 MIN_PROBABILITY=1e-06
controller/recordings/importer.py: MAX_BYTES=4294967296 SAMPLED=2000 _DIGITS=2
controller/remote/examples.py: MOST=60 MOST_S=10.0 LEAD_S=1.3 TAIL_S=0.5 FELT=0.04
controller/remote/examples.py: _MAX_BYTES=4194304
controller/remote/link_recording.py: MOST_S=1800.0 MOST_BYTES=209715200
controller/remote/teacher.py: MOST_SAVED=100
controller/sensors/lines.py: FIRST_S=5.0 MEASURED=16 _STALE_S=0.5 _STALE_FRAMES=3.0 _RETRY_S=0.5
controller/sensors/lines.py: _POLL_S=0.002 _CHUNK=16384 _PARSED=4 _DROPPED=256
host/connection/device_store.py: MOST=64 _MAX_BYTES=262144
host/connection/receiver.py: INBOX=65536 LATE_MS=500 CONNECT_S=30.0
host/connection/transport.py: CHUNK=16384 BACKLOG=65536
host/injection/injector.py: BEAT_MS=50 MUTE_MS=800 START_S=10.0 END_S=0.5
host/injection/watchdog.py: HANG_MS=300 _CHUNK=4096 _IDLE_S=60.0
host/phone/page.py: MAX_FINGERS=10 _FIRST=32 _LIGHT_MM=7.0 _PER_PRESSURE_MM=4.0 _ZONES_PX=160
host/phone/server.py: TURN_S=0.03 SILENCE_S=0.5 REQUEST_S=1.0 WAIT_S=5.0 END_S=0.5 RATE_HZ=200
host/phone/server.py: MAX_BYTES=1024 MAX_CONNECTIONS=8 MAX_WAITING=2
host/phone/server.py: TAKEN=4001 ENDED=4002 MALFORMED=4003
tetris/engine/modes.py: _COMMANDS=8 _ROWS=20 _FEWEST=8 _LATEST=24 _LONGEST_S=4.0 FIRST_LEVEL=3
tetris/engine/rules.py: VERSION=1 LAST_GRAVITY_LEVEL=20 _LEAST_S=0.001 _LONGEST_S=1000000.0
"""


@pytest.mark.parametrize("line", VALUES.strip().splitlines(), ids=lambda line: line.split(" ")[0])
def test_a_limit_has_its_agreed_value(line: str) -> None:
    file, *agreed = line.split()
    module = importlib.import_module(file.removesuffix(".py:").replace("/", "."))
    names = [one.partition("=")[0] for one in agreed]
    assert [f"{name}={getattr(module, name)!r}".replace(", ", ",") for name in names] == agreed
