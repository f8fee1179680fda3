"""A new gesture from a few examples, learned on the device: NumPy only (docs/teach.md).

    example = Example("double_tap", images)         # z images, (frames, rows, columns)
    taught = adapt.teach(path.read_bytes(), [example], command="hold")
    taught.write(Path("mine.orb"))                  # a bundle like any other

What the network was trained for stays: its weights are kept as they are, and some more units beside
its last hidden layer learn from the examples what to add to its answers. So that the old gestures
are not forgotten, a bundle carries some minutes of play to rehearse (`rehearsal.py`), and what it
was taught so; every lesson begins with the network as it was trained, and takes in all of them.
"""

from controller.adapt.examples import Example
from controller.adapt.few_shot import AdaptedBundle, AdaptError, teach

__all__ = ["AdaptError", "AdaptedBundle", "Example", "teach"]
