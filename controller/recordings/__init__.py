"""Recordings: sessions in files that describe themselves (docs/recording.md).

`recording` defines them, `writer` and `reader` store them, `journal` and `recorder` keep a live
session safe until it is sealed. Imports recognition only; sensors, capture and models import it.
"""
