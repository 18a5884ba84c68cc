"""Fitted predictors as plain arrays: they predict with numpy alone and run no code on loading."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robojoule.arrays import Array
from robojoule.errors import InputError

_ROWS = 512  # rows evaluated at once: keeps the work arrays of a forest small

ACTIVATIONS = ("identity", "logistic", "relu", "tanh")


@dataclass(frozen=True)
class Forest:
    """A regression forest whose trees lie one after the other, each node before its left child.

    Attributes:
        roots: Node of every tree's root, shape (T,).
        feature: Input that a node compares, -1 at a leaf, shape (K,).
        value: Threshold of an inner node (left if the input is not above it), prediction of a leaf, shape (K,).
        right: Right child of an inner node, shape (K,); the left child is the next node.
    """

    roots: NDArray[np.int32]
    feature: NDArray[np.int16]
    value: Array
    right: NDArray[np.int32]

    def check(self, inputs: int) -> None:
        """Refuse nodes that lead nowhere.

        Raises:
            ValueError: Arrays that do not fit together, or a child or input that does not exist.
        """
        nodes = np.arange(len(self.value))
        inner = self.feature >= 0
        if not len(self.roots) or not len(self.feature) == len(self.right) == len(self.value):
            raise ValueError("the arrays of a forest do not fit together")
        if self.roots.min() < 0 or self.roots.max() >= len(nodes) or self.feature.max() >= inputs:
            raise ValueError("a forest names a node or an input that does not exist")
        if (self.right[inner] <= nodes[inner]).any() or (self.right[inner] >= len(nodes)).any() or inner[-1]:
            raise ValueError("a forest names a child that does not exist")

    def predict(self, scaled: Array) -> Array:
        """Mean of the trees, shapes (N, inputs) -> (N,)."""
        # Thresholds were chosen between inputs in single precision; only these fall on the right side of them.
        single = scaled.astype(np.float32)
        result = np.empty(len(single))
        for first in range(0, len(single), _ROWS):
            rows = single[first : first + _ROWS]
            node = np.repeat(self.roots[None, :].astype(np.intp), len(rows), axis=0)
            row = np.repeat(np.arange(len(rows))[:, None], len(self.roots), axis=1)
            tree_of, row_of = node.ravel(), row.ravel()
            walking = np.arange(tree_of.size)
            while walking.size:
                at = tree_of[walking]
                inner = self.feature[at] >= 0
                walking, at = walking[inner], at[inner]
                goes_left = rows[row_of[walking], self.feature[at]] <= self.value[at]
                tree_of[walking] = np.where(goes_left, at + 1, self.right[at])
            result[first : first + _ROWS] = self.value[tree_of].reshape(len(rows), -1).mean(axis=1)
        return result


@dataclass(frozen=True)
class Network:
    """A multi-layer perceptron.

    Attributes:
        weights: One matrix a layer, shapes (width before, width after).
        biases: One vector a layer, shapes (width after,).
        activation: Function after every layer but the last, one of `ACTIVATIONS`.
        mean: Means added to the scaled outputs, shape (targets,).
        scale: Deviations by which the scaled outputs are multiplied, shape (targets,).
    """

    weights: tuple[Array, ...]
    biases: tuple[Array, ...]
    activation: str
    mean: Array
    scale: Array

    def check(self, inputs: int) -> None:
        """Refuse layers that do not fit together.

        Raises:
            ValueError: Widths that do not match, or an unknown activation.
        """
        widths = [inputs, *(len(bias) for bias in self.biases)]
        shapes = [weight.shape for weight in self.weights]
        if not shapes or shapes != list(pairwise(widths)):
            raise ValueError("the layers of a network do not fit together")
        if self.activation not in ACTIVATIONS:
            raise ValueError(f"unknown activation '{self.activation}'")
        if self.mean.shape != (widths[-1],) or self.scale.shape != (widths[-1],):
            raise ValueError("the outputs of a network do not fit their scale")

    def predict(self, scaled: Array) -> Array:
        """Outputs in their units, shapes (N, inputs) -> (N, targets)."""
        layer = scaled
        for number, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True), start=1):
            layer = layer @ weight + bias
            if number < len(self.weights):
                layer = _activate(self.activation, layer)
        return layer * self.scale + self.mean


def _activate(name: str, values: Array) -> Array:
    if name == "relu":
        return np.maximum(values, 0.0)
    if name == "tanh":
        return np.tanh(values)
    if name == "logistic":
        return 1.0 / (1.0 + np.exp(-values))
    return values


@dataclass(frozen=True)
class Predictor:
    """A fitted predictor of energy profile parameters.

    Attributes:
        model: Its kind, one of `reproduction.predictors.estimators.MODELS`.
        inputs: Names of the inputs, in order.
        targets: Names of the outputs, in order.
        input_mean: Means taken off the inputs, shape (inputs,).
        input_scale: Deviations by which they are divided, shape (inputs,).
        members: One forest a target, or networks whose outputs are averaged.
    """

    model: str
    inputs: tuple[str, ...]
    targets: tuple[str, ...]
    input_mean: Array
    input_scale: Array
    members: tuple[Forest | Network, ...]

    def predict(self, inputs: ArrayLike) -> Array:
        """Predict profile parameters.

        Args:
            inputs: Inputs in the order of `inputs`, shape (N, inputs).

        Returns:
            Predictions in the order of `targets`, shape (N, targets).

        Raises:
            InputError: Wrong number of inputs, or values that are not finite numbers.
        """
        values = np.asarray(inputs, dtype=float)
        if values.ndim != 2 or values.shape[1] != len(self.inputs):
            raise InputError(f"the inputs have shape {values.shape}", allowed=f"(rows, {len(self.inputs)})")
        if not np.isfinite(values).all():
            name = self.inputs[int(np.flatnonzero(~np.isfinite(values).all(axis=0))[0])]
            raise InputError(f"the input '{name}' holds values that are not finite numbers")
        scaled = (values - self.input_mean) / self.input_scale
        outputs = [member.predict(scaled) for member in self.members]
        if outputs[0].ndim == 1:
            return np.column_stack(outputs)
        return np.asarray(np.mean(outputs, axis=0))
