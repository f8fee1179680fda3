"""Origin of a recording as JSON text that strangers may have written, checked."""

import dataclasses
import json
from typing import Final

from controller.recordings.recording import SCHEMA, Provenance, RecordingError

# Form 1 had no truth and did not say who played; form 2 had no keys, cues, marks and rest.
READABLE: Final = (1, 2, SCHEMA)
MAX_META: Final = 1 << 20  # characters: all labels at their longest, three times
MAX_TEXT: Final = 1000  # characters of any name
MAX_TAXELS: Final = 4096  # 64×64; a frame is kept in one piece
MAX_LABELS: Final = 256
TOO_MUCH: Final = f"says too much of its origin; {MAX_META} characters are allowed"


def text(origin: Provenance) -> str:
    """Return an origin as JSON."""
    return json.dumps(dataclasses.asdict(origin))


def parse(meta: str) -> Provenance:
    """Return the origin that a JSON text describes.

    Raises:
        RecordingError: It describes none, or one that cannot be.
    """
    if len(meta) > MAX_META:
        raise RecordingError(TOO_MUCH)
    try:
        fields = json.loads(meta)
        schema = fields.get("schema")
        if type(schema) is not int or schema not in READABLE:
            raise RecordingError(
                f"has form {str(schema)[:20]}, this program reads "
                f"{', '.join(map(str, READABLE))} (update one)"
            )
        if not isinstance(fields["labels"], list):
            raise TypeError("labels")
        origin = Provenance(**{**fields, "labels": tuple(fields["labels"])})
        possible = _possible(origin)
    except RecordingError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise RecordingError("says nothing legible about its origin") from None
    if not possible:
        raise RecordingError("says impossible things about its origin")
    return origin


def _possible(origin: Provenance) -> bool:
    """Whether every field is of its type and within its limits."""
    texts = (
        *(origin.device_id, origin.bundle, origin.engine, origin.software, *origin.labels),
        *(origin.user, origin.session, origin.protocol, origin.preset),
        *(origin.id, origin.started, origin.hardware, origin.unit),
    )
    sizes = (origin.rows, origin.columns)
    scales = (origin.pitch_mm, origin.rate_hz)
    return (
        all(isinstance(text, str) and len(text) <= MAX_TEXT for text in texts)
        and all(text.isprintable() for text in texts)  # a terminal obeys what is not
        and all(type(size) is int and size > 0 for size in sizes)
        and origin.rows * origin.columns <= MAX_TAXELS
        and 0 < len(set(origin.labels)) == len(origin.labels) <= MAX_LABELS
        and all(type(scale) in (int, float) and 0.0 < scale < 1e6 for scale in scales)
        and (origin.seed is None or (type(origin.seed) is int and 0 <= origin.seed < 1 << 64))
    )
