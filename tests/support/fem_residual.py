"""Bodies after cooling on one rank."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.division.tables import join_meshes, model_inputs
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.supports import SYMMETRY
from reflowshock.fem.model.assembly import ForceOptions, make_body, make_rank_elements
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.stress_recovery import StressRecovery
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.fem.run.cooling import add_pins
from reflowshock.fem.statics.equilibrium import Equilibrium, Statics, thermal_force
from reflowshock.fem.statics.initial_state import with_initial_stress
from reflowshock.materials.parameters import Material

SMALL = ForceOptions()


@dataclass(frozen=True)
class Cooled:
    """Body at rest, its equilibrium after cooling, and the body with its initial stress.

    Attributes:
        plain: Body at rest without stress.
        equilibrium: Equilibrium after cooling.
        body: Body with the initial stress.
        critical: Smallest critical step [s].
        thrust: Thermal forces [N], shape (n, 3).
    """

    plain: Body
    equilibrium: Equilibrium
    body: Body
    critical: float
    thrust: np.ndarray

    @property
    def stress(self) -> np.ndarray:
        """Mean stress of the elements [Pa], shape (ne, 6)."""
        return StressRecovery(self.body, np.arange(len(self.body.elements.cells))).stress(np.zeros_like(self.start))

    @property
    def start(self) -> np.ndarray:
        """Initial displacement of the body."""
        return np.zeros_like(self.plain.local.points)


def cooled(
    mesh: MeshData,
    materials: Mapping[str, Material],
    change: float,
    formulation: str = "incompatible_modes",
    response: ForceOptions = SMALL,
) -> Cooled:
    """Cool a mesh on its symmetry planes and return bodies without and with the initial stress.

    Args:
        mesh: Mesh with the facet sets of its symmetry planes.
        materials: Role -> material.
        change: Change of temperature [K].
        formulation: Kind of element.
        response: Kinematics and damping of the force terms.
    """
    item = add_pins(model_inputs(join_meshes(mesh), "dns", SYMMETRY)["dns"])
    rank_elements = make_rank_elements(distribute(MPI.COMM_SELF, item.mesh), item.tables, materials, formulation)

    def body() -> Body:
        return make_body(MPI.COMM_SELF, rank_elements, item.tables, np.ones(len(rank_elements.steps)), response)

    equilibrium = Statics(MPI.COMM_SELF, body(), rank_elements.materials, change).solve()
    plain = body()
    return Cooled(
        plain,
        equilibrium,
        with_initial_stress(body(), rank_elements.materials, equilibrium.displacement, change, path=True),
        float(rank_elements.steps.min()),
        thermal_force(plain, slice(None), rank_elements.materials, change),
    )


def layered(x: np.ndarray, y: np.ndarray, layers: Mapping[str, np.ndarray], distorted: float = 0.0) -> MeshData:
    """Return stacked layers from z = 0 with symmetry planes x = 0 and y = 0.

    Args:
        x: Node positions along x.
        y: Node positions along y.
        layers: Part -> heights of its elements, lowest first.
        distorted: Size of random moves of inner nodes over the element size.
    """
    z = np.concatenate([[0.0], np.cumsum(np.concatenate(list(layers.values())))])
    names = np.repeat(list(layers), [len(heights) for heights in layers.values()])
    points, cells = grid(x, y, z)
    moved = np.random.default_rng(5).uniform(-distorted, distorted, points.shape)
    for axis, places in enumerate((x, y, z)):
        inner = (points[:, axis] > places[0]) & (points[:, axis] < places[-1])
        points[:, axis] += np.where(inner, moved[:, axis] * np.diff(places).min(), 0.0)
    centre = np.searchsorted(z, points[cells, 2].mean(axis=1)) - 1
    return mesh_of(points, cells, names[centre], {"symmetry_x": on(0, 0.0), "symmetry_y": on(1, 0.0)})
