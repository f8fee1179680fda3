"""A random forest, judged on people it has not seen, beside our network; then it plays Tetris.

Options, such as `--seconds 60`, are those of `host`.
"""

import sys

import numpy as np
from sklearn.ensemble import RandomForestClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer

import orbtouch


def flat(windows: np.ndarray) -> np.ndarray:
    """Return windows, (n, window, rows, columns), as rows of numbers."""
    return windows.reshape(len(windows), -1)


people = [orbtouch.simulate(minutes=1, user=user) for user in range(3)]
network = orbtouch.load_network()
forest = make_pipeline(FunctionTransformer(flat), RandomForestClassifier(100, random_state=0))
mine, shipped = (orbtouch.evaluate(one, people) for one in (forest, network))
print(mine, shipped, orbtouch.compare(mine, shipped), sep="\n\n")

learned = [one.windows() for one in people]
forest.fit(np.concatenate([one.X for one in learned]), np.concatenate([one.y for one in learned]))
classes = learned[0].classes
orbtouch.play(forest.predict_proba, classes=classes, base=network, words=sys.argv[1:])
