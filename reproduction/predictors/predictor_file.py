"""Predictors of three numbers as folders of two files, see `robojoule.profile.array_file`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Literal

from pydantic import Field

from reproduction.predictors.array_predictor import Forest, Network, Predictor
from robojoule.arrays import Array
from robojoule.documents import Document, load, write_document
from robojoule.profile.array_file import ARRAYS, DESCRIPTION, Arrays, read_arrays, write_arrays


class PredictorFile(Document):
    """`predictor.json` of a predictor of three numbers."""

    format: Literal["robojoule-predictor"] = "robojoule-predictor"
    format_version: Literal[1] = 1
    model: str = Field(min_length=1, description="Kind of model.")
    inputs: tuple[str, ...] = Field(min_length=1, description="Inputs, in order.")
    targets: tuple[str, ...] = Field(min_length=1, description="Outputs, in order.")
    member: Literal["forest", "network"] = Field(description="What the members are: a forest a target, or networks.")
    members: int = Field(ge=1, le=1000, description="How many members.")
    layers: int = Field(default=0, ge=0, le=100, description="Layers of every network.")
    activation: str = Field(default="", description="Function between a network's layers.")


def save_predictor(predictor: Predictor, folder: str | Path) -> None:
    """Write a predictor; the same predictor gives the same bytes."""
    folder = Path(folder)
    arrays: Arrays = {"input_mean": predictor.input_mean, "input_scale": predictor.input_scale}
    layers, activation = 0, ""
    kind: Literal["forest", "network"] = "forest"
    for number, member in enumerate(predictor.members):
        if isinstance(member, Forest):
            arrays |= {f"{number}_{name}": getattr(member, name) for name in ("roots", "feature", "value", "right")}
        else:
            layers, activation = len(member.weights), member.activation
            kind = "network"
            arrays |= {f"{number}_mean": member.mean, f"{number}_scale": member.scale}
            arrays |= {f"{number}_weights_{layer}": weight for layer, weight in enumerate(member.weights)}
            arrays |= {f"{number}_biases_{layer}": bias for layer, bias in enumerate(member.biases)}
    write_arrays(folder / ARRAYS, arrays)
    description = PredictorFile(
        model=predictor.model,
        inputs=predictor.inputs,
        targets=predictor.targets,
        member=kind,
        members=len(predictor.members),
        layers=layers,
        activation=activation,
    )
    write_document(folder / DESCRIPTION, description.model_dump(mode="json"))


def load_predictor(folder: str | Path) -> Predictor:
    """Read a predictor written by `save_predictor`; no code of the files runs.

    Raises:
        InputError: A file is missing, truncated or does not hold a predictor.
    """
    folder = Path(folder)
    described = load(PredictorFile, folder / DESCRIPTION)
    return read_arrays(folder / ARRAYS, partial(_assemble, described))


def _assemble(described: PredictorFile, arrays: Arrays) -> Predictor:
    inputs = len(described.inputs)
    numbers = range(described.members)
    mean, scale = _vector(arrays["input_mean"], inputs), _vector(arrays["input_scale"], inputs)
    members: tuple[Forest | Network, ...]
    if described.member == "forest":
        if described.members != len(described.targets):
            raise ValueError("there must be one forest per target")
        members = tuple(
            Forest(*(arrays[f"{number}_{name}"] for name in ("roots", "feature", "value", "right")))
            for number in numbers
        )
    else:
        members = tuple(
            Network(
                weights=tuple(arrays[f"{number}_weights_{layer}"] for layer in range(described.layers)),
                biases=tuple(arrays[f"{number}_biases_{layer}"] for layer in range(described.layers)),
                activation=described.activation,
                mean=_vector(arrays[f"{number}_mean"], len(described.targets)),
                scale=_vector(arrays[f"{number}_scale"], len(described.targets)),
            )
            for number in numbers
        )
    for member in members:
        member.check(inputs)
    return Predictor(described.model, described.inputs, described.targets, mean, scale, members)


def _vector(array: Array, length: int) -> Array:
    if array.shape != (length,):
        raise ValueError(f"an array has shape {array.shape} instead of ({length},)")
    return array
