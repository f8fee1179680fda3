"""Recordings: what a session was, in one file that describes itself (docs/recording.md).

`recording` says what there is, `writer` and `reader` carry it to a file and back, `journal` and
`recorder` keep a live session safe until it is sealed.
"""
