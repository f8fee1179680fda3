"""Few-shot learning of gestures on the device, with NumPy only (docs/teach.md).

    example = Example("double_tap", images)         # z images, (frames, rows, columns)
    taught = adapt.teach(path.read_bytes(), [example], command="hold")
    taught.write(Path("mine.orb"))                  # a bundle like any other

The weights of the network are kept, and additional units beside its last hidden layer are fitted to
the examples; `forget` removes them again. Against forgetting of the older gestures, a bundle
carries some minutes of recorded play for rehearsal and all examples so far (`rehearsal.py`); each
fit begins with the network as it was trained.
"""

from controller.adapt.examples import Example
from controller.adapt.few_shot import AdaptedBundle, AdaptError, teach
from controller.adapt.unlearn import forget

__all__ = ["AdaptError", "AdaptedBundle", "Example", "forget", "teach"]
