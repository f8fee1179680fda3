"""Transfer of weights: a training starts from the networks of another bundle.

Layers are taken from the input on, until one does not fit. Kernels of another length, and the
dense layer behind maps of another size, are resampled. Everything else starts from random.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import torch
from torch import Tensor, nn

from controller.bundles.bundle import Bundle
from controller.bundles.head import Head
from controller.bundles.inference import onnx_reader, onnx_shapes
from models.training.networks import Network

State = Mapping[str, Tensor]  # weights by name, as in a state dict
Places = tuple[int, ...]  # size of the maps before the first dense layer: (steps,) rows, columns

OUTPUT: Final = "out"  # layers as in models.training.networks
FIRST_DENSE: Final = "dense1"
RESAMPLING: Final = {2: "bilinear", 3: "trilinear"}  # by the number of axes


@dataclass(frozen=True, slots=True)
class Start:
    """Weights that two trainings start from; those of other layers are random."""

    gesture: State = field(default_factory=dict)
    location: State = field(default_factory=dict)
    lines: tuple[str, ...] = ()  # what was taken, a sentence a network


def take(new: State, new_places: Places, old: State, old_places: Places) -> tuple[State, str]:
    """Return the weights of `old` in the shapes of `new`, and what was taken, in words.

    Both are state dicts without normalisation; the result has the layers that fit. It is empty, as
    are the words, if not even the first one fits.
    """
    taken: dict[str, Tensor] = {}
    words: list[str] = []
    for name in [key.removesuffix(".weight") for key in new if key.endswith(".weight")]:
        before, wanted = old.get(f"{name}.weight"), new[f"{name}.weight"]
        places = (old_places, new_places) if name == FIRST_DENSE else None
        weight = None if before is None else _fitted(before, wanted.shape, places)
        if before is None or weight is None:
            break
        taken |= {f"{name}.weight": weight, f"{name}.bias": old[f"{name}.bias"]}
        words.append(name if weight is before else f"{name} (resampled)")
    return taken, ", ".join(words)


def _fitted(old: Tensor, shape: torch.Size, places: tuple[Places, Places] | None) -> Tensor | None:
    """Return a layer's weights in a shape; None if they do not fit. `places`: old and new maps."""
    if places is not None:
        if old.shape[0] != shape[0] or len(places[0]) != len(places[1]):
            return None
        if places[0] == places[1]:
            return old if old.shape == shape else None
        made = _resampled(old.reshape(len(old), -1, *places[0]), places[1]).flatten(1)
        return made if made.shape == shape else None
    if old.shape == shape:
        return old
    # A kernel through time: (maps, inputs, span, 3, 3).
    if old.ndim == len(shape) == 5 and old.shape[:2] == shape[:2] and old.shape[3:] == shape[3:]:
        return _resampled(old, tuple(shape[2:]))
    return None


def _resampled(weight: Tensor, size: Places) -> Tensor:
    """Return weights (a, b, *axes) with axes of other lengths; a constant input has one answer."""
    before = weight[0, 0].numel()
    made = nn.functional.interpolate(weight, size=size, mode=RESAMPLING[len(size)])
    return made * (before / made[0, 0].numel())


def start(
    bundle: Bundle, labels: tuple[str, ...], gesture: Network | None, location: Network | None,
    shape: tuple[int, int, int], grid: tuple[int, int],
) -> Start:  # fmt: skip
    """Return the weights of a bundle for new networks of windows (images, rows, columns).

    `grid` are the rows and columns of CNN-2D's input. A network that is None is not trained.
    ValueError if nothing fits.
    """
    states: list[State] = []
    lines = []
    asked = (
        ("CNN-3D", gesture, bundle.embedding_onnx, bundle.head, shape, labels == bundle.labels),
        ("CNN-2D", location, bundle.location_onnx, None, grid, True),
    )
    for name, net, model, head, size, same in asked:
        taken, words = _taken(net, model, head, size, same=same) if net and model else ({}, "")
        states.append(taken)
        if net:
            lines.append(f"{name} starts from the bundle's {words or 'nothing: it is random'}")
    if not any(states):
        raise ValueError(
            "nothing of the bundle named with --from fits: its layers have other widths or other "
            "kernels than those of the recipe; leave --from out, or name a bundle of this recipe"
        )
    return Start(states[0], states[1], tuple(lines))


def _taken(
    net: Network, model: bytes, head: Head | None, size: Places, *, same: bool
) -> tuple[State, str]:
    """Return what a network takes from an ONNX file and a head; its output if it is the `same`."""
    graph = onnx_reader.read(model)
    flat = next(node for node in graph.nodes if node.op == "Flatten")
    old_places = onnx_shapes.sizes(graph).shapes[flat.inputs[0]][2:]
    old = state_of(model, head)
    folded = net.folded()
    layers = list(folded.children())
    depth = next(n for n, layer in enumerate(layers) if isinstance(layer, nn.Flatten))
    with torch.no_grad():
        maps = nn.Sequential(*layers[:depth])(torch.zeros(1, *size))
    new = {
        name: weight
        for name, weight in folded.named_parameters()
        if same or not name.startswith(OUTPUT)
    }
    return take(new, tuple(maps.shape[2:]), old, old_places)


def state_of(model: bytes, head: Head | None) -> State:
    """Return the weights of a network, by name, in an ONNX file and a head that comes after it."""
    graph = onnx_reader.read(model)
    arrays = dict(graph.weights)
    if head is not None:
        hidden = f"dense{1 + sum(node.op == 'Gemm' for node in graph.nodes)}"
        arrays |= {f"{hidden}.weight": head.hidden, f"{hidden}.bias": head.hidden_bias}
        arrays |= {f"{OUTPUT}.weight": head.out, f"{OUTPUT}.bias": head.out_bias}
    return {name: torch.tensor(array) for name, array in arrays.items()}


def begin(net: Network, state: State, inputs: Tensor) -> None:
    """Load weights into a network in place; inputs are some of its examples, (n, ...).

    A bundle's layers are without normalisation. That of a loaded layer so gets the mean and the
    deviation of its inputs, and changes nothing at first.
    """
    net.load_state_dict(dict(state), strict=False)
    x = inputs
    with torch.no_grad():
        for name, layer in net.eval().named_children():
            if isinstance(layer, nn.BatchNorm1d | nn.BatchNorm3d | nn.BatchNorm2d):
                if f"{name.removesuffix('_norm')}.weight" not in state:
                    break
                _settle(layer, x)
            x = layer(x)


def _settle(norm: nn.BatchNorm1d | nn.BatchNorm2d | nn.BatchNorm3d, x: Tensor) -> None:
    """Give a layer the statistics of its inputs (n, maps, ...), so that it returns them."""
    variance, mean = torch.var_mean(x, dim=[0, *range(2, x.ndim)], correction=0)
    assert norm.running_mean is not None
    assert norm.running_var is not None
    norm.running_mean.copy_(mean)
    norm.running_var.copy_(variance)
    norm.weight.copy_((variance + norm.eps).sqrt())
    norm.bias.copy_(mean)
