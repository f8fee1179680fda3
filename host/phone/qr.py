"""QR code of a text."""

from qrcode.constants import ERROR_CORRECT_M
from qrcode.main import QRCode


def code(text: str) -> QRCode:
    """Return the code, with the border of four light modules that readers need."""
    made = QRCode(error_correction=ERROR_CORRECT_M, border=4)
    made.add_data(text)
    return made
