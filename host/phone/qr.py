"""QR code of a text."""

import sys

from qrcode.constants import ERROR_CORRECT_M
from qrcode.main import QRCode

BORDER = 4  # light modules round the code, which readers need


def modules(text: str) -> list[list[bool]]:
    """Return the rows of modules, True where dark, with their border."""
    code = QRCode(error_correction=ERROR_CORRECT_M, border=BORDER)
    code.add_data(text)
    return [[bool(dark) for dark in row] for row in code.get_matrix()]


def show(text: str) -> None:
    """Print the code on standard error, with two modules in a letter."""
    code = QRCode(error_correction=ERROR_CORRECT_M, border=BORDER)
    code.add_data(text)
    code.print_ascii(out=sys.stderr, invert=True)
