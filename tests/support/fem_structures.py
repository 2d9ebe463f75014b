"""Small structures for tests: input of a run and its mesh."""

import json
from pathlib import Path

import numpy as np

from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.problem.inputs import INPUT, StructureInput
from tests.support.fem_models import write_msh

LENGTH, WIDTH, THICKNESS = 20e-3, 8e-3, 1e-3
STEEL = {"kind": "isotropic", "density": 8000.0, "young_modulus": 200e9, "poisson_ratio": 0.3}


def strip_mesh(cells: tuple[int, int, int] = (8, 3, 2), layers: tuple[str, ...] = ("board",)) -> MeshData:
    """Return the mesh of a rectangular strip with layers of equal thickness and facet sets on all sides.

    Args:
        cells: Numbers of elements along x, y and z.
        layers: Names of the layers, lowest first.
    """
    x = np.linspace(-LENGTH / 2, LENGTH / 2, cells[0] + 1)
    y = np.linspace(-WIDTH / 2, WIDTH / 2, cells[1] + 1)
    points, hexahedra = grid(x, y, np.linspace(0.0, THICKNESS, cells[2] + 1))
    height = points[hexahedra].mean(axis=1)[:, 2]
    part = np.array(layers)[(height / THICKNESS * len(layers)).astype(int)]
    sides = {"x_min": on(0, x[0]), "x_max": on(0, x[-1]), "y_min": on(1, y[0]), "y_max": on(1, y[-1])}
    return mesh_of(points, hexahedra, part, sides | {"z_min": on(2, 0.0), "z_max": on(2, THICKNESS)})


def structure_tables_of(**changes) -> dict:
    """Return the tables of the input of a clamped steel strip under a shock; ``changes`` replace whole tables."""
    tables = {
        "mode": "structure",
        "solver": "explicit",
        "structure": {
            "length": LENGTH,
            "width": WIDTH,
            "cells": [8, 3],
            "layers": {"board": {"material": "steel", "thickness": THICKNESS, "cells": 2}},
        },
        "materials": {"steel": STEEL},
        "supports": {"clamp": {"on": "x_min", "hold": ["x", "y", "z"]}},
        "loads": {"drop": {"kind": "input_g", "peak": 1e4, "duration": 4e-5}},
        "watch": {"tip": {"at": [LENGTH / 2, 0.0, THICKNESS]}, "root": {"at": [-LENGTH / 4, 0.0, THICKNESS]}},
        "dynamics": {"duration": 8e-5, "numerics": {"history_samples": 40, "field_samples": 3}},
    }
    return tables | changes


def write_structure(directory: Path, mesh: MeshData | None = None, **changes) -> Path:
    """Write mesh and input file of a structure; return the path of the input.

    Args:
        directory: Folder of the files; results go to its subfolder ``out``.
        mesh: Mesh; None for the strip of ``strip_mesh``.
        changes: Tables of the input that replace others.
    """
    path = directory / "structure.msh"
    write_msh(mesh or strip_mesh(), path)
    tables = {"mesh": str(path), "output": str(directory / "out")} | structure_tables_of(**changes)
    file = directory / "input.json"
    file.write_text(json.dumps(tables))
    return file


def structure_input(directory: Path, mesh: MeshData | None = None, **changes) -> StructureInput:
    """Write the mesh of a structure and return the input of its run; arguments as of ``write_structure``.

    Args:
        directory: Folder of the mesh; results go to its subfolder ``out``.
        mesh: Mesh; None for the strip of ``strip_mesh``.
        changes: Tables of the input that replace others.
    """
    request = INPUT.validate_json(write_structure(directory, mesh, **changes).read_text())
    assert isinstance(request, StructureInput)
    request.output.mkdir(exist_ok=True)
    return request
