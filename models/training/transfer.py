"""Transfer of weights: a training starts from the networks of another bundle of the same sensor.

Layers are taken from the input on, until one does not fit. Everything else starts from random.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import torch
from torch import Tensor, nn

from controller.bundles.bundle import Bundle
from controller.bundles.head import Head
from controller.bundles.inference import onnx_reader
from models.training.networks import Network

State = Mapping[str, Tensor]  # weights by name, as in a state dict

OUTPUT: Final = "out"  # layer as in models.training.networks


@dataclass(frozen=True, slots=True)
class Start:
    """Weights that two trainings start from; those of other layers are random."""

    gesture: State = field(default_factory=dict)
    location: State = field(default_factory=dict)
    lines: tuple[str, ...] = ()  # what was taken, a sentence a network


def start(
    bundle: Bundle, labels: tuple[str, ...], gesture: Network | None, location: Network | None
) -> Start:
    """Return the weights of a bundle for new networks; one that is None is not trained.

    ValueError if nothing fits.
    """
    same = labels == bundle.labels
    states = (
        _taken(gesture, bundle.embedding_onnx, bundle.head, same=same),
        _taken(location, bundle.location_onnx, None, same=True),
    )
    if not any(states):
        raise ValueError(
            "nothing of the bundle named with --from fits: its layers have other widths or other "
            "kernels than those of the recipe; leave --from out, or name a bundle of this recipe"
        )
    lines = []
    for name, net, state in zip(("CNN-3D", "CNN-2D"), (gesture, location), states, strict=True):
        if net:
            layers = [key.removesuffix(".weight") for key in state if key.endswith(".weight")]
            words = ", ".join(layers) or "nothing: it is random"
            lines.append(f"{name} starts from the bundle's {words}")
    return Start(*states, tuple(lines))


def _taken(net: Network | None, model: bytes, head: Head | None, *, same: bool) -> State:
    """Return what a network takes from an ONNX file and a head; its output if it is the `same`."""
    if net is None or not model:
        return {}
    new = {
        name: weight
        for name, weight in net.folded().named_parameters()
        if same or not name.startswith(OUTPUT)
    }
    return take(new, state_of(model, head))


def take(new: State, old: State) -> State:
    """Return the weights of `old` for the layers of `new`, up to the first that does not fit.

    Both are state dicts without normalisation.
    """
    taken: dict[str, Tensor] = {}
    for name, weight in new.items():
        if name not in old or old[name].shape != weight.shape:
            break
        taken[name] = old[name]
    return taken


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
