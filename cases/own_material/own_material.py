"""User material in a drop: a part on a board strip in viscoelastic potting at finite strain.

    python -m reflowshock.cases.own_material.own_material            (a few seconds; also under mpirun -n 2)

The potting is a UFL law (``potting`` below); board and part are the program's own elements. See README.md.
"""

import sys
from math import exp

import numpy as np
import ufl
from mpi4py import MPI

from reflowshock.fem.division.tables import prepare
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.participant import explicit_motion
from reflowshock.fem.forces.force_ufl import Law
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.mesh.mesh import MeshData, boundary_facets
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_rank_elements
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.library import FR4
from reflowshock.materials.parameters import Isotropic

MM, MS, G = 1e-3, 1e-3, 9.81
SHEAR, BULK = 2e6, 40e6  # long-term shear and bulk modulus of the potting [Pa]
STIFFER, RELAXATION = 3.0, 0.2 * MS  # instantaneous over long-term shear modulus minus one; relaxation time
STEEL = Isotropic(density=7850.0, young_modulus=200e9, poisson_ratio=0.3)
POTTING = Isotropic(density=1100.0, young_modulus=6e6, poisson_ratio=0.48)  # only the density is used besides the law
PEAK, PULSE = 1500.0 * G, 0.2 * MS


def potting(step: float, stiffer: float = STIFFER) -> Law:
    """Return the law of a neo-Hookean rubber with one Maxwell branch on its deviator (Simo, CMAME 60, 1987).

    S = S_vol + S_iso + Q, dQ/dt + Q / tau = g dS_iso/dt, integrated over a step exactly for a constant rate of S_iso.
    """
    decay, half = exp(-step / RELAXATION), exp(-0.5 * step / RELAXATION)

    def stretch(gradient):
        deformation = ufl.Identity(3) + gradient
        return deformation, deformation.T * deformation, ufl.det(deformation)

    def isochoric(gradient):
        _, right, volume = stretch(gradient)
        return SHEAR * volume ** (-2.0 / 3.0) * (ufl.Identity(3) - ufl.tr(right) / 3.0 * ufl.inv(right))

    def stress(gradient, internal):
        deformation, right, volume = stretch(gradient)
        volumetric = BULK * ufl.ln(volume) * ufl.inv(right)
        return deformation * (volumetric + isochoric(gradient) + internal["branch"])

    def energy(gradient, internal):
        _, right, volume = stretch(gradient)
        rubber = 0.5 * SHEAR * (volume ** (-2.0 / 3.0) * ufl.tr(right) - 3.0) + 0.5 * BULK * ufl.ln(volume) ** 2
        held = ufl.inner(internal["branch"], internal["branch"]) / (4.0 * stiffer * SHEAR) if stiffer else 0.0
        return rubber + held

    def update(gradient, internal):
        new = isochoric(gradient)
        return {"branch": decay * internal["branch"] + half * stiffer * (new - internal["last"]), "last": new}

    return Law(energy, stress, {"branch": (3, 3), "last": (3, 3)}, update)


def mesh() -> MeshData:
    """Mesh a board strip of 40 x 8 x 1.6 mm clamped at its ends, with potting and a part of 8 x 8 mm on its middle."""
    x, y, z = np.arange(-20, 21, 2) * MM, np.arange(-4, 5, 2) * MM, np.array([-1.6, 0, 0.7, 1.4, 3.4]) * MM
    number = np.arange(len(x) * len(y) * len(z)).reshape(len(z), len(y), len(x))
    ends = slice(None, -1), slice(1, None)
    cells = np.stack([number[ends[a >> 2], ends[a >> 1 & 1], ends[a & 1]].ravel() for a in range(8)], axis=1)
    points = np.stack(np.meshgrid(z, y, x, indexing="ij")[::-1], axis=-1).reshape(-1, 3)
    centre = points[cells].mean(axis=1)
    part = np.select([centre[:, 2] < 0, centre[:, 2] < 1.4 * MM], [0, 1], 2).astype(np.int32)
    is_filled = (part == 0) | (np.abs(centre[:, 0]) < 4 * MM)
    used, cells = np.unique(cells[is_filled], return_inverse=True)
    points, cells = points[used], cells.reshape(-1, 8).astype(np.int32)
    faces = boundary_facets(cells)
    clamped = faces[np.isclose(np.abs(points[faces, 0].mean(axis=1)), 20 * MM)]
    return MeshData(points, cells, part[is_filled], ("board", "potting", "part"), {"mounting_holes": clamped})


def drop(comm: MPI.Comm, stiffer: float = STIFFER, duration: float = 0.5 * MS) -> dict[str, np.ndarray]:
    """Drop the board; return the displacement of the part over the clamps [m] and energies [J] by time; collective."""
    model = prepare(mesh(), "dns")["dns"] if comm.rank == 0 else None
    tables = comm.bcast(model.tables if model else None)
    local = distribute(comm, model.mesh if model else None)
    rank_elements = make_rank_elements(local, tables, {"board": FR4, "potting": POTTING, "part": STEEL})
    sudden = rank_elements.with_laws(tables.part_names, {"potting": potting(0.0, stiffer)})
    step = 0.8 * comm.allreduce(float(sudden.steps.min()), MPI.MIN)
    rank_elements = rank_elements.with_laws(tables.part_names, {"potting": potting(step, stiffer)})
    body = make_body(comm, rank_elements, tables, np.ones(len(rank_elements.steps)), ForceOptions("small", step))
    motion = explicit_motion(body, [half_sine_drop(PEAK, PULSE)], step)
    top = body.shared.owned & np.isclose(body.local.points[:, 2], 3.4 * MM)
    rows = []
    for k in range(int(duration / step)):
        motion.advance()
        motion.update_force()
        if k % 20 == 0:
            rows.append(sample(comm, motion, top))
    return dict(zip(("time", "part", "kinetic", "stored", "dissipated", "given"), np.array(rows).T, strict=True))


def sample(comm: MPI.Comm, motion: ExplicitMotion, top: np.ndarray) -> tuple[float, ...]:
    """Return time, mean z displacement of the part's top, and energies of all ranks; collective."""
    internal = motion.internal_energy()
    row = [motion.displacement[top, 2].sum(), top.sum(), motion.kinetic_energy(), internal.strain, internal.plastic]
    way, count, *energies = comm.allreduce(np.array([*row, motion.external_work]))
    return motion.time, way / count, *energies


def main(output: str = "", milliseconds: str = "0.5") -> None:
    """Compare the potting with one without relaxation; write the first history if a file name is given."""
    comm, duration = MPI.COMM_WORLD, float(milliseconds) * MS
    results = {"viscoelastic": drop(comm, duration=duration), "elastic": drop(comm, 0.0, duration)}
    if comm.rank:
        return
    print("potting        part moves  dissipated  energies balance")
    for name, run in results.items():
        error = run["kinetic"] + run["stored"] + run["dissipated"] - run["given"]
        print(
            f"{name:13s}{1e6 * np.abs(run['part']).max():9.1f} um{1e6 * run['dissipated'][-1]:9.1f} uJ"
            f"    within {np.abs(error).max() / run['given'].max():.1e}"
        )
    if output:
        np.savez(output, **results["viscoelastic"])


if __name__ == "__main__":
    main(*sys.argv[1:])
