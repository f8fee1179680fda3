"""A random forest, judged on people it has not seen, beside the network that ships."""

import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

import orbtouch


def flat(windows: np.ndarray) -> np.ndarray:
    """Return windows, (n, window, rows, columns), as rows of numbers."""
    return windows.reshape(len(windows), -1)


people = [orbtouch.simulate(minutes=1, user=user) for user in range(3)]
forest = make_pipeline(FunctionTransformer(flat), RandomForestClassifier(100, random_state=0))
mine, shipped = (orbtouch.evaluate(one, people) for one in (forest, orbtouch.load_network()))
print(mine, shipped, orbtouch.compare(mine, shipped), sep="\n\n")
