"""Bodies on one rank from meshes in memory by the program's own chain, and metals for them."""

import numpy as np
from mpi4py import MPI

from reflowshock.fem.division.tables import Tables, prepare
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.elements.element import Elements
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.model.assembly import ForceOptions, RankElements, make_body, make_rank_elements
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.library import FR4
from reflowshock.materials.parameters import Isotropic, JohnsonCook, Material
from reflowshock.materials.plasticity import plastic_constants
from reflowshock.materials.roles import ELASTIC, Materials

SOLDER = Isotropic(
    density=7400.0,
    young_modulus=50e9,
    poisson_ratio=0.36,
    plasticity=JohnsonCook(A=40e6, B=300e6, n=0.7, C=0.05, reference_rate=1.0),
)
LINEAR_HARDENING = SOLDER.model_copy(update={"plasticity": JohnsonCook(A=40e6, B=500e6, n=1.0)})


def dns_elements(mesh: MeshData, materials: Materials) -> tuple[RankElements, Tables]:
    """Return the elements of all parts on one rank."""
    item = prepare(mesh, "dns")["dns"]
    return make_rank_elements(distribute(MPI.COMM_SELF, item.mesh), item.tables, materials), item.tables


def dns_body(mesh: MeshData, board=FR4, materials: Materials | None = None) -> tuple[Body, float]:
    """Return a body of all parts and its smallest critical element step [s]; ``materials`` override ``board``."""
    rank_elements, tables = dns_elements(mesh, materials or ELASTIC.model_copy(update={"board": board}))
    body = make_body(MPI.COMM_SELF, rank_elements, tables, np.ones(len(rank_elements.steps)))
    return body, float(rank_elements.steps.min())


def motion_of(body: Body, step: float, loads=(), held=()) -> ExplicitMotion:
    """Return the motion of a body from rest."""
    return ExplicitMotion(body, loads, step, np.array(held, np.int32), np.zeros(len(body.mass)))


def nonlinear(elements: Elements, material: Material, finite: bool, step: float = np.inf) -> NonlinearElements:
    """Return the nonlinear term of elements of one material."""
    plastic = np.array([plastic_constants(material)])
    return NonlinearElements.build(elements, np.arange(len(elements.cells)), plastic, Path(finite, step))


def force_of(term: NonlinearElements, displacement: np.ndarray) -> np.ndarray:
    """Return the internal force (n, 3) [N] of the next step of the path."""
    force = np.zeros_like(displacement)
    term.add(displacement, force)
    return -force


def nonlinear_body(
    mesh: MeshData, material: Material, response: ForceOptions, formulation: str = "one_point"
) -> tuple[Body, float]:
    """Return a body of one material and its smallest critical element step [s]."""
    item = prepare(mesh, "dns")["dns"]
    materials = dict.fromkeys(item.tables.part_names, material)
    rank_elements = make_rank_elements(distribute(MPI.COMM_SELF, item.mesh), item.tables, materials, formulation)
    body = make_body(MPI.COMM_SELF, rank_elements, item.tables, np.ones(len(rank_elements.steps)), response)
    return body, rank_elements.steps.min()
