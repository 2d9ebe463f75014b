"""This program, Akantu and Kratos on the same cube of 40^3 linear hexahedra, one thread each, in turns.

    PYTHONPATH=. python benchmarks/peers.py  (a minute; writes results/peers.json)

The peers are installed from PyPI in an environment under ``build/``. All compute linear elasticity at small strain on
8-node hexahedra. The peers integrate strains and stresses at 2 x 2 x 2 Gauss points in each call. This program has
incompatible modes in addition, and uses one matrix for all boxes (``congruent``) or the assembled matrix for hexahedra
of any shape (``assembled``). ``force`` is the internal force alone, ``step`` a whole central difference step. Kratos
offers no force alone. At a homogeneous strain all nodal forces must be equal: this is checked.
"""

import os
import subprocess
import venv
from collections.abc import Sequence
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np

from benchmarks.support import results, turns
from benchmarks.support.cube import STEEL, cube, elements_of
from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.forces.force_congruent import CongruentElements
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.materials.parameters import Isotropic

FOLDER = Path(__file__).parents[1] / "build" / "peers"
PYTHON = FOLDER / "venv" / "bin" / "python"
PACKAGES = {
    "akantu": ["akantu==5.0.7.*"],
    "kratos": [
        f"Kratos{name}==10.4.4"
        for name in ("Multiphysics", "StructuralMechanicsApplication", "ConstitutiveLawsApplication")
    ],
}
WORKS = {"akantu": ("force", "step"), "kratos": ("step",)}
CYCLIC = [0, 1, 3, 2, 4, 5, 7, 6]
SAME = 1e-9  # relative: nodal forces at a homogeneous strain
BAR = 20.0
ROUNDS = 7


class Peer:
    """Process that runs a peer in its own environment and executes work on request."""

    def __init__(self, name: str, problem_file: Path) -> None:
        """Start the process and wait until it has written its internal force."""
        self._force = problem_file.with_suffix(f".{name}.npy")
        script = Path(__file__).parent / "support" / f"peer_{name}.py"
        self._process = subprocess.Popen(
            [str(PYTHON), str(script), str(problem_file), str(self._force)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
        )
        self._answer()
        self.force = np.load(self._force)

    def ask(self, work: str) -> float:
        """Return the processor seconds of one call of a named work."""
        print(work, file=self._process.stdin, flush=True)
        return float(self._answer())

    def end(self) -> None:
        """End the process."""
        self._process.stdin.close()
        self._process.wait()

    def _answer(self) -> str:
        for line in self._process.stdout:
            if line.startswith("@"):
                return line[1:].strip()
        raise RuntimeError(f"the peer ended with exit code {self._process.wait()}")


def install() -> list[str]:
    """Install the other programs (peers) in an environment of their own; return the names of the available ones."""
    if not PYTHON.exists():
        venv.create(FOLDER / "venv", with_pip=True)
    installed = []
    for name, packages in PACKAGES.items():
        command = [str(PYTHON), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *packages]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode == 0:
            installed.append(name)
        else:
            print(f"{name} is left out, pip cannot install it: {done.stderr.strip().splitlines()[-1]}")
    return installed


def write_problem(
    mesh: MeshData, displacement: np.ndarray, step: float, material: Isotropic = STEEL, finite: bool = False
) -> Path:
    """Write a body at a displacement as input of a peer process (NPZ); return the path of the file.

    Args:
        mesh: Mesh of hexahedra.
        displacement: Nodal displacements [m], shape (n, 3).
        step: Time step [s].
        material: Material of all elements; of its plasticity only the yield stress is used.
        finite: Whether strains are finite.
    """
    path = FOLDER / f"{'finite' if finite else 'small'}.npz"
    arrays = model_arrays(mesh, np.zeros(len(mesh.cells), int), [material])
    np.savez(path, displacement=displacement, step=step, finite=finite, **arrays)
    return path


def model_arrays(mesh: MeshData, material: np.ndarray, materials: Sequence[Isotropic]) -> dict[str, np.ndarray]:
    """Return the arrays of a model for a peer process.

    Args:
        mesh: Mesh of hexahedra.
        material: Number of the material of each cell, shape (ne,).
        materials: Materials by number; of their plasticity only the yield stress is used.

    Returns:
        ``points`` [m], ``cells`` (nodes in cyclic order), ``material``, and ``constants``: density, Young's modulus,
        Poisson's ratio and yield stress (nan if elastic) of each material.
    """
    constants = [
        [item.density, item.young_modulus, item.poisson_ratio, item.plasticity.A if item.plasticity else np.nan]
        for item in materials
    ]
    return {
        "points": mesh.points,
        "cells": mesh.cells[:, CYCLIC],
        "material": material,
        "constants": np.array(constants),
    }


def program_batches(mesh: MeshData, displacement: np.ndarray) -> tuple[dict[str, turns.Batch], np.ndarray, float]:
    """Prepare the works of this program on a cube.

    Args:
        mesh: Mesh of hexahedra.
        displacement: Nodal displacements, shape (n, 3) [m].

    Returns:
        Name -> function that works and returns processor seconds per call; internal force at the displacement, shape
        (n, 3) [N]; half the critical step [s].
    """
    elements = elements_of(mesh)
    terms = {"congruent": CongruentElements.build(elements), "assembled": AssembledElements.build(elements)}
    force = np.zeros_like(displacement)
    terms["congruent"].add(displacement, force)
    body, critical = dns_body(mesh, STEEL)
    motion = motion_of(body, 0.5 * critical)
    motion.displacement[:] = displacement[motion.body.local.nodes]
    scratch = np.zeros_like(displacement)

    def step() -> None:
        motion.advance()
        motion.update_force()

    batches = {
        f"{name}_force": turns.make_batch(lambda term=term: term.add(displacement, scratch))
        for name, term in terms.items()
    }
    return batches | {"congruent_step": turns.make_batch(step)}, force, 0.5 * critical


def main() -> None:
    """Measure this program and the peers in turns; store and print rates, ratios and limits."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    names = install()
    mesh = cube()
    gradient = np.random.default_rng(2).uniform(-1e-3, 1e-3, (3, 3))
    displacement = mesh.points @ gradient.T
    batches, force, step = program_batches(mesh, displacement)
    problem_file = write_problem(mesh, displacement, step)
    peers = {name: Peer(name, problem_file) for name in names}
    for name, peer in peers.items():
        difference = float(np.abs(peer.force - force).max() / np.abs(force).max())
        if not difference < SAME:
            raise RuntimeError(
                f"{name} has different nodal forces at a homogeneous strain: relative difference {difference:.2e}"
            )
        for work in WORKS[name]:
            batches[f"{name}_{work}"] = lambda peer=peer, work=work: peer.ask(work)
    seconds = turns.measure_in_turns(batches, ROUNDS)
    for peer in peers.values():
        peer.end()
    pairs = [(f"congruent_{work}", f"{name}_{work}") for name in peers for work in WORKS[name]]
    pairs += [("assembled_force", f"{name}_force") for name in peers if "force" in WORKS[name]]
    ratios = {f"{ours} / {theirs}": turns.speed_ratio(seconds, ours, theirs) for ours, theirs in pairs}
    results.write_and_print(
        "peers",
        {
            "elements": len(mesh.cells),
            "packages": [package for name in names for package in PACKAGES[name]],
            "updates_per_second": turns.rates(seconds, dict.fromkeys(seconds, len(mesh.cells))),
            "ratios": ratios,
            "bars": {name: turns.bar(value, BAR) for name, value in ratios.items()},
        },
    )


if __name__ == "__main__":
    main()
