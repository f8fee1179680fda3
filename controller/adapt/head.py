"""Split a gesture network into its embedding and the layers after it, and fit more units there.

The form is that of the shipped network (figure 6 of the paper): ... dense, relu = embedding; dense,
relu; dense, softmax. New units beside those of the second dense layer take the embedding, and their
outputs are added to the logits. No old weight changes, so the network as trained can be restored.
The units are fitted by gradient descent (Adam) on the cross entropy, in NumPy.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from controller.bundles.inference import onnx_reader as graph
from controller.bundles.inference import onnx_writer, onnxruntime_engine
from controller.bundles.inference.onnx_reader import Graph, GraphError, Node

Matrix = NDArray[np.float32]  # (rows, columns), or a vector (n,)

_EMBEDDED: Final = 64  # windows that are embedded at once
TEAMS: Final = 3  # size of the ensemble: members are fitted separately and averaged
UNITS: Final = 16  # of a member, without the constant unit
STEPS: Final = 300
BATCH: Final = 512
RATE: Final = 5e-3  # falls to nothing along a cosine
DECAY: Final = 1e-2  # of the weights, times the rate, a step
_SEED: Final = 0  # of the first weights and of the batches
_FIRST, _SECOND, _TINY = 0.9, 0.999, 1e-8  # Adam's moments: Kingma and Ba 2015, algorithm 1


class FormError(ValueError):
    """The network has another form; the message has no subject."""


@dataclass(frozen=True, slots=True, eq=False)
class LearnedUnits:
    """Fitted hidden units and their weights in the logits."""

    weights: Matrix  # (units, embedding)
    bias: Matrix  # (units,)
    out: Matrix  # output weights, (classes, units); the old classes first

    def answers(self, embedding: Matrix) -> Matrix:
        """Return the units' contribution to the logits, (n, classes), for (n, embedding)."""
        hidden = np.maximum(embedding @ self.weights.T + self.bias, 0.0)
        return np.asarray(hidden @ self.out.T)


@dataclass(frozen=True, eq=False)
class SplitNetwork:
    """A network as it was trained, split at its embedding."""

    graph: Graph
    embedding: str  # name of the embedding's array
    dense: tuple[str, str]  # the second dense layer: names of its weights and bias
    out: tuple[str, str]  # the last dense layer: names of its weights and bias
    hidden: int  # units of the second dense layer
    classes: int  # outputs

    def embed(self, windows: NDArray[np.float32]) -> Matrix:
        """Return the embedding of windows (n, window, rows, columns), (n, width)."""
        at = next(i for i, node in enumerate(self.graph.nodes) if node.output == self.embedding)
        cut = replace(self.graph, nodes=self.graph.nodes[: at + 1], output=self.embedding)
        network = onnxruntime_engine.network(onnx_writer.write(cut))
        parts = range(0, len(windows), _EMBEDDED)
        return np.concatenate([network(windows[first : first + _EMBEDDED]) for first in parts])

    def logits(self, embedding: Matrix) -> Matrix:
        """Return the logits of the network as it was trained, (n, classes)."""
        weights = self.graph.weights
        hidden = np.maximum(embedding @ weights[self.dense[0]].T + weights[self.dense[1]], 0.0)
        return np.asarray(hidden @ weights[self.out[0]].T + weights[self.out[1]])

    def widened(self, units: LearnedUnits) -> bytes:
        """Return the ONNX file of the network with the learned units and all their classes."""
        weights = dict(self.graph.weights)
        dense, bias = (weights[name] for name in self.dense)
        old, old_bias = (weights[name] for name in self.out)
        out = np.zeros((len(units.out), self.hidden + len(units.bias)), dtype=np.float32)
        out[: self.classes, : self.hidden] = old
        out[:, self.hidden :] = units.out
        none = np.zeros(len(out) - self.classes, dtype=np.float32)
        weights[self.dense[0]] = np.vstack([dense, units.weights]).astype(np.float32)
        weights[self.dense[1]] = np.concatenate([bias, units.bias]).astype(np.float32)
        weights[self.out[0]] = out
        weights[self.out[1]] = np.concatenate([old_bias, none])
        return onnx_writer.write(replace(self.graph, weights=weights), width=len(out))


def split(model: bytes, base: tuple[int, int] | None = None) -> SplitNetwork:
    """Return the network in an ONNX file as it was trained.

    `base`: units of its second dense layer and classes when it was trained; None: as now.

    Raises:
        FormError: The network has another form.
    """
    try:
        read = graph.read(model)
    except GraphError as error:
        raise FormError(str(error)) from None
    makers = {node.output: node for node in read.nodes}
    softmax = makers[read.output]
    out = _dense(makers, read, softmax, "Softmax")
    relu = makers.get(out.inputs[0])
    dense = _dense(makers, read, relu, "Relu")
    if dense.inputs[0] not in makers:
        raise _other()
    rows, bias = read.weights[dense.inputs[1]], read.weights[dense.inputs[2]]
    answers, answers_bias = read.weights[out.inputs[1]], read.weights[out.inputs[2]]
    hidden, classes = base or (len(rows), len(answers))
    if not (1 <= hidden <= len(rows) and 2 <= classes <= len(answers)):
        raise FormError("is smaller than when it was trained")
    weights = dict(read.weights)
    weights[dense.inputs[1]], weights[dense.inputs[2]] = rows[:hidden], bias[:hidden]
    weights[out.inputs[1]] = answers[:classes, :hidden]
    weights[out.inputs[2]] = answers_bias[:classes]
    return SplitNetwork(
        replace(read, weights=weights),
        dense.inputs[0],
        (dense.inputs[1], dense.inputs[2]),
        (out.inputs[1], out.inputs[2]),
        hidden,
        classes,
    )


def _dense(makers: dict[str, Node], read: Graph, after: Node | None, op: str) -> Node:
    """Return the dense layer before the operator `after`, which must be an `op`."""
    if after is None or after.op != op:
        raise _other()
    node = makers.get(after.inputs[0])
    plain = node is not None and node.op == "Gemm" and len(node.inputs) == 3
    if node is None or not plain or node.attributes != {"transB": 1}:
        raise _other()
    if any(name not in read.weights for name in node.inputs[1:]):
        raise _other()
    return node


def _other() -> FormError:
    return FormError(
        "does not end in dense, relu, dense, relu, dense, softmax, so nothing can be added to it"
    )


# --- fitting --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class TrainingSet:
    """Training data of n windows."""

    embedding: Matrix  # (n, width)
    logits: Matrix  # of the network as it was trained, (n, old classes)
    target: Matrix  # probabilities, (n, classes); each row sums to 1
    weight: NDArray[np.float64]  # of each window, (n,)


def fit(data: TrainingSet, progress: Callable[[float], None]) -> LearnedUnits:
    """Return units fitted to the targets; `progress` is called with the share that is done."""
    members = []
    for team in range(TEAMS):
        members.append(_team(data, np.random.default_rng([_SEED, team])))
        progress((team + 1) / TEAMS)
    return LearnedUnits(
        np.concatenate([team.weights for team in members]),
        np.concatenate([team.bias for team in members]),
        np.asarray(np.concatenate([team.out for team in members], axis=1) / TEAMS, np.float32),
    )


def _team(data: TrainingSet, rng: np.random.Generator) -> LearnedUnits:
    """Return the units of one member of the ensemble."""
    mean, spread = _scale(data)
    seen = ((data.embedding - mean) / spread).astype(np.float32)
    count, classes = len(seen), data.target.shape[1]
    old = data.logits.shape[1]
    parameters: list[Matrix] = [
        (rng.normal(size=(seen.shape[1], UNITS)) * np.sqrt(2.0 / seen.shape[1])).astype(np.float32),
        np.zeros(UNITS, dtype=np.float32),
        np.zeros((UNITS, classes), dtype=np.float32),
        np.zeros(classes, dtype=np.float32),
    ]
    first = [np.zeros_like(one) for one in parameters]
    second = [np.zeros_like(one) for one in parameters]
    drawn = np.cumsum(data.weight / data.weight.sum())
    logits = np.zeros((BATCH, classes), dtype=np.float32)
    for step in range(1, STEPS + 1):
        batch = np.minimum(np.searchsorted(drawn, rng.random(BATCH)), count - 1)
        x = seen[batch]
        hidden_weights, hidden_bias, out_weights, out_bias = parameters
        hidden = np.maximum(x @ hidden_weights + hidden_bias, 0.0)
        logits[:] = hidden @ out_weights + out_bias
        logits[:, :old] += data.logits[batch]
        power = np.exp(logits - logits.max(axis=1, keepdims=True))
        off = (power / power.sum(axis=1, keepdims=True) - data.target[batch]) / BATCH
        back = (off @ out_weights.T) * (hidden > 0.0)
        gradients = (x.T @ back, back.sum(axis=0), hidden.T @ off, off.sum(axis=0))
        rate = 0.5 * RATE * (1.0 + np.cos(np.pi * step / STEPS))
        for i, gradient in enumerate(gradients):
            first[i] += (1.0 - _FIRST) * (gradient - first[i])
            second[i] += (1.0 - _SECOND) * (np.square(gradient) - second[i])
            slope = first[i] / (1.0 - _FIRST**step)
            slope /= np.sqrt(second[i] / (1.0 - _SECOND**step)) + _TINY
            parameters[i] -= (rate * slope).astype(np.float32)
            if parameters[i].ndim == 2:
                parameters[i] *= np.float32(1.0 - rate * DECAY)
    hidden_weights, hidden_bias, out_weights, out_bias = parameters
    # The scale is merged into the weights; a constant unit carries the bias of the output.
    weights = (hidden_weights / spread[:, None]).T
    offset = hidden_bias - (mean / spread) @ hidden_weights
    return LearnedUnits(
        np.vstack([weights, np.zeros((1, len(mean)))]).astype(np.float32),
        np.append(offset, 1.0).astype(np.float32),
        np.column_stack([out_weights.T, out_bias]).astype(np.float32),
    )


def _scale(data: TrainingSet) -> tuple[Matrix, Matrix]:
    """Return mean and deviation of each number of the embedding, each (width,).

    A lower bound of the deviation keeps nearly constant numbers from being amplified.
    """
    share = data.weight / data.weight.sum()
    mean = share @ data.embedding
    spread = np.sqrt(share @ np.square(data.embedding - mean))
    return mean.astype(np.float32), (spread + 0.1 * float(spread.mean()) + 1e-6).astype(np.float32)
