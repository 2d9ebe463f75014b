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
    """Return layers ``layer_0``, ``layer_1`` ... from material, thickness [m], elements along the bar and in plane."""
    names = ("material", "thickness", "cells", "in_plane")
    return {f"layer_{k}": dict(zip(names, layer, strict=True)) for k, layer in enumerate(layers)}


def write_bar(directory: Path, width: float, layers: Mapping[str, dict], pulse: float, **changes) -> StructureInput:
    """Write mesh and input of a bar under a pulse [s]; ``changes`` replace or add whole tables."""
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
    """Run a bar; return its result and its history."""
    run_structure(comm, request)
    with np.load(request.output / "history.npz") as arrays:
        return json.loads((request.output / "result.json").read_text()), dict(arrays)
