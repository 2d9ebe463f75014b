"""Initial stress of a shock after cooling, derived from the displacement of cooling.

If everything is linear and small, the motion does not depend on the initial stress, and stresses add. Otherwise
path-dependent and corotational elements start with the stress and plastic strain of their integration points, and
linear elements carry a constant force (``pretension``). At the coupling interface each model leaves out the sum of its
initial forces, which the forces of the other model would cancel.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.tables import ModelInput, TablesT_co
from reflowshock.fem.division.whole import Whole
from reflowshock.fem.elements.stress import element_stress
from reflowshock.fem.errors import MeshError
from reflowshock.fem.estimates.placement import Role
from reflowshock.fem.forces.force import ForceTerm
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.forces.nonlinear_blocks import in_modes
from reflowshock.fem.loads.pretension import Pretension
from reflowshock.fem.model.body import Body
from reflowshock.fem.statics.equilibrium import thermal_force
from reflowshock.fem.statics.hencky import HenckyElements, free_expansion
from reflowshock.materials.parameters import Material

SAME = 1e-9  # largest distance between nodes of equal meshes, relative to the size of the mesh


@dataclass(frozen=True, slots=True)
class Cooling:
    """Displacement of cooling at the nodes of a joined mesh.

    Attributes:
        points: Stress-free positions of the nodes, shape (n, 3) [m].
        displacement: Displacement by cooling, shape (n, 3) [m].
        change: Temperature change [K].
    """

    points: NDArray[np.float64]
    displacement: NDArray[np.float64]
    change: float

    def write(self, path: Path) -> None:
        """Write the cooling file."""
        np.savez(path, points=self.points, displacement=self.displacement, change=self.change)

    @classmethod
    def read(cls, path: Path) -> "Cooling":
        """Read a cooling file written by ``write``."""
        with np.load(path) as arrays:
            return cls(arrays["points"], arrays["displacement"], float(arrays["change"]))

    def check(self, whole: Whole) -> None:
        """Check that a mesh is the one that was cooled.

        Raises:
            MeshError: The meshes differ.
        """
        points = whole.mesh.points
        size = float(np.ptp(points, axis=0).max())
        if points.shape != self.points.shape or np.abs(points - self.points).max() > SAME * size:
            raise MeshError(
                f"the residual stress belongs to another mesh ({len(self.points)} nodes, this mesh has {len(points)});"
                " use the same fine joints for cooling and shock"
            )


@dataclass(frozen=True, slots=True)
class InitialState:
    """Initial state of the models of a run.

    Attributes:
        displacement: Displacement of cooling at the nodes of each model, shape (n, 3) [m].
        change: Temperature change [K].
        path: Whether an element of the run yields or has finite rotations.
    """

    displacement: Mapping[Role, NDArray[np.float64]]
    change: float
    path: bool

    @classmethod
    def of(
        cls, cooling: Cooling, whole: Whole, inputs: Mapping[Role, ModelInput[TablesT_co]], path: bool
    ) -> "InitialState":
        """Select the nodes of each model from the joined mesh.

        Raises:
            MeshError: The residual stress was computed on another mesh.
        """
        cooling.check(whole)
        displacement = {}
        for role, item in inputs.items():
            displacement[role] = np.zeros((item.tables.nodes, 3))
            displacement[role][item.mesh.cells] = cooling.displacement[whole.mesh.cells[item.cells]]
        return cls(displacement, cooling.change, path)

    def begin(self, role: Role, body: Body, materials: Sequence[Material]) -> Body:
        """Return a body with this initial state; collective over its model.

        Args:
            role: Role of the model.
            body: Stress-free body at rest.
            materials: Material of each index of its elements.
        """
        displacement = np.ascontiguousarray(self.displacement[role][body.local.nodes])
        return with_initial_stress(body, materials, displacement, self.change, self.path)


def with_initial_stress(
    body: Body, materials: Sequence[Material], displacement: NDArray[np.float64], change: float, path: bool
) -> Body:
    """Return a body with the residual stress of cooling; collective over its model.

    Args:
        body: Stress-free body at rest on this rank.
        materials: Material of each index of its elements.
        displacement: Displacement of cooling at the n nodes of this rank, shape (n, 3) [m].
        change: Temperature change [K].
        path: Whether an element of any model yields or has finite rotations; if not, no forces are added, since a
            stress in equilibrium does not change linear motion.
    """
    initial = _mean_stress(body, materials, displacement, change)
    begin = partial(_set_initial_points, materials=materials, displacement=displacement, change=change)
    body = replace(body, initial_stress=initial, begin=begin)
    return _with_initial_forces(body, materials, displacement, change) if path else body


def _mean_stress(
    body: Body, materials: Sequence[Material], displacement: NDArray[np.float64], change: float
) -> NDArray[np.float64]:
    """Return the elastic mean stress of all elements after a temperature change [K], shape (ne, 6) [Pa]."""
    elements = body.elements
    expansion = free_expansion(materials, change)[elements.material]
    straining = displacement[elements.cells] - expansion[:, None] * elements.points[elements.cells]
    return element_stress(body.geometry.gradient, elements.elasticity[elements.material], straining)


def _with_initial_forces(
    body: Body, materials: Sequence[Material], displacement: NDArray[np.float64], change: float
) -> Body:
    """Return a body whose elements carry their initial stress, without resultants at the interface; collective."""
    linear = [term for term in body.terms if not isinstance(term, NonlinearElements)]
    chosen = np.ones(len(body.elements.cells), dtype=bool)
    for term in body.terms:
        if isinstance(term, NonlinearElements):
            chosen[term.numbers] = False
            _set_initial_points(term, materials, displacement, change)
    expanding = thermal_force(body, chosen, materials, change)
    suppressed = _expansion_energy(body, chosen, materials, change)
    pretension = _pretension_of(linear, displacement, expanding, suppressed)
    terms = [*body.terms, pretension]
    _balance_interface(body, terms, pretension)
    return replace(body, terms=terms)


def _set_initial_points(
    term: NonlinearElements, materials: Sequence[Material], displacement: NDArray[np.float64], change: float
) -> None:
    """Set stress and plastic strain at the integration points of path-dependent elements, padding lanes included."""
    points = HenckyElements.build(term.elements, materials, free_expansion(materials, change)).points(displacement)
    order, state = term.lanes.element, term.lanes.view(term.history["state"])
    state[..., :6] = points.stress[order]
    state[..., 6] = points.plastic_strain[order]
    if "hourglass" in term.history:
        term.history["hourglass"][...] = points.hourglass_energy[order]
    if "slip" in term.history:
        term.lanes.view(term.history["slip"])[...] = -in_modes(points.stretched)[order]


def _expansion_energy(body: Body, chosen: NDArray[np.bool_], materials: Sequence[Material], change: float) -> float:
    """Return the elastic energy of suppressed thermal expansion of selected elements, shape (ne,) [J]."""
    strain = np.zeros((len(materials), 6))
    strain[:, :3] = free_expansion(materials, change)
    density = 0.5 * np.einsum("mi,mij,mj->m", strain, body.elements.elasticity, strain)[body.elements.material]
    return float(density[chosen] @ body.geometry.volume[chosen])


def _pretension_of(
    linear: Sequence[ForceTerm],
    displacement: NDArray[np.float64],
    expanding: NDArray[np.float64],
    suppressed: float,
) -> Pretension:
    """Return initial force and energy of the linear elements.

    Args:
        linear: Force terms of the linear elements.
        displacement: Displacement of cooling, shape (n, 3) [m].
        expanding: Nodal forces of suppressed thermal expansion, shape (n, 3) [N].
        suppressed: Energy of suppressed thermal expansion [J].
    """
    force = np.zeros_like(displacement)
    for term in linear:
        term.add(displacement, force)
    stored = suppressed - float(np.vdot(displacement, expanding + 0.5 * force))
    return Pretension(-force - expanding, stored)


def _balance_interface(body: Body, terms: Sequence[ForceTerm], pretension: Pretension) -> None:
    """Adjust the pretension so that the initial forces at interface nodes add up to zero; collective."""
    rest, force = np.zeros_like(pretension.force), np.zeros_like(pretension.force)
    for term in terms:
        term.add(rest, force)
    body.tie.gather(force)
    body.shared.add(force)
    nodes = body.interface[body.interface >= 0]
    nodes = nodes[body.shared.owned[nodes]]
    pretension.force[nodes] += force[nodes]
