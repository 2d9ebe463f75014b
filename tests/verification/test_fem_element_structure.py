"""A clamped strip under a shock, from mesh file to results, for each element type."""

import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.boxes import KINDS, box
from reflowshock.cases.hard.trials.grids import mesh_of, on
from reflowshock.fem.run.structure import run_structure
from tests.support.fem_structures import LENGTH, THICKNESS, WIDTH, structure_input, structure_tables_of

CELLS = (16, 4, 2)


def history(directory: Path, name: str) -> dict[str, np.ndarray]:
    """Run a clamped strip of a kind of element in a folder; return its history."""
    kind = KINDS[name]
    low, high = np.array([-LENGTH / 2, -WIDTH / 2, 0.0]), np.array([LENGTH / 2, WIDTH / 2, THICKNESS])
    lines = [np.linspace(*ends, count + 1) for *ends, count in zip(low, high, CELLS, strict=True)]
    points, cells = box(kind, *lines)
    mesh = mesh_of(points, cells, "board", {"x_min": on(0, low[0]), "x_max": on(0, high[0])})
    shape = {"element": "hexahedron", "formulation": name} if kind.nodes == 8 else {"element": name}
    structure = structure_tables_of()["structure"] | {"cells": CELLS[:2]} | shape
    directory.mkdir()
    request = structure_input(directory, mesh, structure=structure)
    run_structure(MPI.COMM_SELF, request)
    result = json.loads((request.output / "result.json").read_text())
    assert all(check["ok"] for check in result["health"].values()), result["health"]
    assert list(request.output.glob("*.vtu"))
    with np.load(request.output / "history.npz") as arrays:
        return dict(arrays)


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> dict[str, dict[str, np.ndarray]]:
    """Return kind of element -> history of the strip."""
    return {name: history(tmp_path_factory.mktemp("strip") / name, name) for name in KINDS}


@pytest.mark.parametrize("name, tolerance", [("one_point", 1e-9), ("tetrahedron_quadratic", 0.02)])
def test_locking_free_elements_agree(runs, name, tolerance):
    ours, theirs = (runs[kind]["displacement@tip"] for kind in (name, "incompatible_modes"))
    assert np.abs(ours - theirs).max() < tolerance * np.abs(theirs).max()


def test_linear_tetrahedra_are_too_stiff(runs):
    assert (
        np.abs(runs["tetrahedron"]["displacement@tip"]).max()
        < 0.9 * np.abs(runs["incompatible_modes"]["displacement@tip"]).max()
    )


def test_only_one_point_elements_report_hourglass_energy(runs):
    for name, run in runs.items():
        assert (run["hourglass"].max() > 0.0) == (name == "one_point")
    ours, theirs = runs["one_point"], runs["incompatible_modes"]
    total = ours["hourglass"] + ours["internal"]
    assert total == pytest.approx(theirs["internal"], rel=1e-6, abs=1e-9 * total.max())
