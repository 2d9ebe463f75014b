"""Trial of a rod of solder that strikes a wall: waves, yielding and turning at once, and all energy accounted for."""

from collections.abc import Callable

import numpy as np

from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.forces.force import Kinematics
from reflowshock.fem.materials.parameters import Material
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.assembly import ForceOptions
from reflowshock.fem.model.body import Body
from reflowshock.fem.trials.bodies import motion_of, nonlinear_body
from reflowshock.fem.trials.grids import grid, mesh_of, on
from reflowshock.fem.trials.metals import SOLDER
from reflowshock.fem.trials.parameters import Impact


def impact(given: Impact) -> dict[str, float]:
    """Return the largest imbalance of energy, what plastic flow has taken, and whether it ever gave any back."""

    def skew(points: np.ndarray) -> np.ndarray:
        return points + np.outer(points[:, 1], [0.0, 0.0, given.skew])

    mesh = rod(6e-3, 1e-3, (18, 3), skew)
    body, motion = explicit(mesh, SOLDER, given.kinematics, given.element, given.step_fraction)
    motion.velocity[:, 0] = np.where(body.free[:, 0], -given.speed, 0.0)
    energies = march(motion, given.steps)
    first = energies[0].sum()
    return {
        "energy_error": imbalance(energies),
        "plastic_share": float(energies[-1, 2] / first),
        "plastic_return": float(np.abs(np.diff(energies[:, 2]).min(initial=0.0)) / first),
        "hourglass_share": float(np.abs(energies[:, 3]).max() / first),
    }


def rod(
    length: float,
    width: float,
    counts: tuple[int, int],
    move: Callable[[np.ndarray], np.ndarray] = lambda points: points,
) -> MeshData:
    """Return a rod along x, held at x = 0 in that direction."""
    across = np.linspace(0, width, counts[1] + 1)
    points, cells = grid(np.linspace(0, length, counts[0] + 1), across, across)
    return mesh_of(move(points), cells, "board", {"symmetry_x": on(0, 0.0), "symmetry_y": on(1, 0.0)})


def explicit(
    mesh: MeshData, material: Material, kinematics: Kinematics, formulation: str, fraction: float
) -> tuple[Body, ExplicitMotion]:
    """Return a body of one material and its motion at a fraction of the critical step of its elements."""
    _, critical = nonlinear_body(mesh, material, ForceOptions(kinematics, np.inf), formulation)
    body, _ = nonlinear_body(mesh, material, ForceOptions(kinematics, fraction * critical), formulation)
    return body, motion_of(body, fraction * critical)


def march(motion: ExplicitMotion, steps: int) -> np.ndarray:
    """Take steps; return kinetic, strain, plastic and hourglass energy at each: (steps + 1, 4)."""
    energies = []
    for _ in range(steps + 1):
        held = motion.internal_energy()
        energies.append([motion.kinetic_energy(), held.strain, held.plastic, held.hourglass])
        motion.advance()
        motion.update_force()
    return np.array(energies)


def imbalance(energies: np.ndarray) -> float:
    """Return the largest change of the sum of energies (steps + 1, k) over the first one."""
    total = energies.sum(axis=1)
    return float(np.abs(total - total[0]).max() / total[0])
