"""Values as JSON has them, for whatever is written beside a bundle or a report."""

import json
import math
from collections.abc import Mapping
from typing import Any, Final

DIGITS: Final = 6


def text(value: Any) -> str:
    """Return a value as the text of a JSON file; what is no number becomes null."""
    return json.dumps(plain(value), indent=1, allow_nan=False, ensure_ascii=False)


def plain(value: Any) -> Any:
    """Return mappings as dictionaries, sequences as lists, and numbers rounded to six digits."""
    if isinstance(value, Mapping):
        return {str(key): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return round(value, DIGITS) if math.isfinite(value) else None
    return value
