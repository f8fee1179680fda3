"""Few-shot learning of gestures on the device, with NumPy only (docs/teach-terminal.md).

    example = Example("double_tap", images)         # z images, (frames, rows, columns)
    taught = adapt.teach(path.read_bytes(), [example], command="hold")
    bundle.write(Path("mine.orb"), manifest=taught.manifest, parts=taught.parts)

The embedding network stays as it was trained, and rows of the head are fitted to the examples;
`forget` removes them again. Against forgetting of the older gestures, a bundle carries embeddings
of its training and all examples so far (`lessons`); each fit begins with the head as trained.
"""

from controller.adapt.examples import Example
from controller.adapt.few_shot import AdaptedBundle, AdaptError, forget, teach

__all__ = ["AdaptError", "AdaptedBundle", "Example", "forget", "teach"]
