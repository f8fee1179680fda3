"""Authentication of frames with a pre-shared key: eight bytes a frame.

Each session derives two keys, one for each direction, from the shared key and the nonces of both
sides. A frame of another session, direction or position in the stream is therefore refused. The
frames are not encrypted. Source of the construction: HMAC, RFC 2104, with SHA-256, truncated as
section 5 allows.
"""

import hmac
from typing import Final

SIZE: Final = 8  # bytes of a tag: a forged one passes once in 2**64
NONCE: Final = 16  # random bytes of each side for each session
_PURPOSE: Final = b"OrbTouch link, sessions"


class FrameAuthenticator:
    """Authentication of one direction of one session; both ends hold an equal one.

    The tag covers the packet's full number, of which the wire carries the lower 16 bits. A packet
    that is replayed after the sequence has wrapped is therefore refused, too.
    """

    def __init__(self, key: bytes, sequence: int) -> None:
        """Begin after the packet numbered `sequence`: Hello, or the answer to it."""
        self._key = key
        self._count = sequence  # the full number of the newest packet

    def tag(self, body: bytes, sequence: int) -> bytes:
        """Return the tag of the next packet to send."""
        self._count = self._full(sequence)
        return self._mac(body, self._count)

    def confirms(self, body: bytes, sequence: int, tag: bytes) -> bool:
        """Return whether a received tag is valid, for any bytes."""
        count = self._full(sequence)
        if count < 0 or not hmac.compare_digest(self._mac(body, count), tag):
            return False
        self._count = max(self._count, count)
        return True

    def _full(self, sequence: int) -> int:
        """Return the full number nearest to the newest one."""
        return self._count + (sequence - self._count + 0x8000 & 0xFFFF) - 0x8000

    def _mac(self, body: bytes, count: int) -> bytes:
        return hmac.digest(self._key, count.to_bytes(8, "little") + body, "sha256")[:SIZE]


def seals(
    key: bytes,
    *,
    versions: tuple[int, int],
    host: bytes,
    device: bytes,
    session: int,
    sequence: int,
) -> tuple[FrameAuthenticator, FrameAuthenticator]:
    """Return the authenticators of a session: of the host's packets, and of the device's.

    `host` and `device` are the nonces of Hello and Offer. `versions`, the least and greatest in
    Hello, cannot be changed in transit; `sequence` is that of Hello.
    """
    numbers = bytes(versions) + session.to_bytes(2, "little") + sequence.to_bytes(2, "little")
    drawn = b"".join([len(part).to_bytes(2, "little") + part for part in (host, device)])
    own = hmac.digest(key, _PURPOSE + numbers + drawn, "sha256")
    ours, theirs = (hmac.digest(own, side, "sha256") for side in (b"host", b"device"))
    return FrameAuthenticator(ours, sequence), FrameAuthenticator(theirs, sequence)
