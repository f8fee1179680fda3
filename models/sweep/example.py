"""A sweep to begin with: a minute on two cores."""

from typing import Final

TEXT: Final = """\
# How many people must teach before others are understood, and does a larger step do?
# models sweep THIS_FILE trains every combination; docs/sweeps.md explains every line.

[data]                     # simulated people; or: folders = ["data"]
seed = 0
users = 6
sessions = 1               # of each
minutes = 1.5              # each

[train]                    # how every network is trained
recipe = "default"
gesture.epochs = 4         # any setting of the recipe (models/recipe.py)

[test]                     # who is judged, and never learned from
by = "user"                # or "session"
hold = 2                   # always the same two; or: folds = 3, everybody in turn

[axes]                     # every combination is trained
users = [1, 2, 4]
gesture.rate = [0.002, 0.008]
seed = [0, 1]              # repeats: other people are drawn, other first weights
"""
