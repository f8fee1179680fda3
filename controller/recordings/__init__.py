"""Recordings: sessions in self-describing files (docs/recording.md).

`recording` defines them, `writer` and `reader` store them, `journal` and `recorder` protect a live
session against a crash until it is sealed.
"""
