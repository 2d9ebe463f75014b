"""Layered bar with held sides (uniaxial strain) under a smooth pressure pulse: mesh, run and exact waves."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from mpi4py import MPI

from reflowshock.fem.problem.inputs import INPUT, StructureInput
from reflowshock.fem.run.structure import run_structure
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import LIBRARY
from reflowshock.meshing.board.box import write_box
from reflowshock.meshing.board.box_plan import Box, BoxLayer

HELD = {f"{axis}_{end}": {"on": f"{axis}_{end}", "hold": [axis]} for axis in "xy" for end in ("min", "max")}
PEAK = 1e6  # [Pa]


def speed_of(material: str) -> float:
    """Return the speed [m/s] of plane waves along z in a material of the library."""
    return float(np.sqrt(elasticity_matrix(LIBRARY[material])[2, 2] / LIBRARY[material].density))


def bar_layers(*layers: tuple[str, float, int, tuple[int, int]]) -> dict[str, dict]:
    """Return the layers of a bar for its input: ``layer_0``, ``layer_1`` ... -> table of the layer.

    Args:
        layers: Material, thickness [m], number of elements along the bar, and numbers in plane, of each layer.
    """
    names = ("material", "thickness", "cells", "in_plane")
    return {f"layer_{k}": dict(zip(names, layer, strict=True)) for k, layer in enumerate(layers)}


def write_bar(directory: Path, width: float, layers: Mapping[str, dict], pulse: float, **changes) -> StructureInput:
    """Write the mesh of a bar along z with held sides, and return the input of its run under a pressure pulse.

    Args:
        directory: Folder of the mesh; results go to its subfolder ``out``.
        width: Side of the square cross-section [m].
        layers: Layers of ``bar_layers``.
        pulse: Duration of the pulse [s].
        changes: Tables of the input that replace others or are added.
    """
    (directory / "out").mkdir(parents=True, exist_ok=True)
    shapes = tuple(BoxLayer(name, *list(layer.values())[1:]) for name, layer in layers.items())
    write_box(Box((width, width), (1, 1), shapes), directory / "bar.msh")
    tables: dict = {
        "mode": "structure",
        "solver": "explicit",
        "structure": {"length": width, "width": width, "cells": (1, 1), "layers": dict(layers)},
        "supports": HELD,
        "loads": {"push": {"kind": "pressure", "on": "z_min", "peak": PEAK, "pulse": "haversine", "duration": pulse}},
        "mesh": str(directory / "bar.msh"),
        "output": str(directory / "out"),
    }
    return INPUT.validate_json(json.dumps(tables | changes))


def run_bar(request: StructureInput, comm: MPI.Comm = MPI.COMM_SELF) -> tuple[dict, dict[str, np.ndarray]]:
    """Run a bar; return its result (contents of ``result.json``) and its history, name -> samples; collective."""
    run_structure(comm, request)
    with np.load(request.output / "history.npz") as arrays:
        return json.loads((request.output / "result.json").read_text()), dict(arrays)
