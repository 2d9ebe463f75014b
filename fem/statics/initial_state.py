"""The state in which a shock begins: a displacement of cooling, from which every stress follows.

Where all is linear and small the motion does not know of it: stresses add. Elsewhere elements that yield or turn begin
with the stress and plastic strain of their integration points, linear ones with a constant force (``pretension``). Each
model leaves out what its forces at the interface add up to: the other model's are the opposite.
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
from reflowshock.fem.forces.force_nonlinear import NonlinearElements, by_lane
from reflowshock.fem.forces.nonlinear_blocks import in_modes
from reflowshock.fem.loads.pretension import Pretension
from reflowshock.fem.model.body import Body
from reflowshock.fem.statics.equilibrium import thermal_force
from reflowshock.fem.statics.hencky import HenckyElements, free_expansion
from reflowshock.materials.parameters import Material

SAME = 1e-9  # of the size of a mesh: how far nodes of the file may be from its own


@dataclass(frozen=True, slots=True)
class Cooling:
    """What cooling did to a whole mesh, in its numbers.

    Attributes:
        points: ``(n, 3)`` [m] where it was free of stress.
        displacement: ``(n, 3)`` [m] since.
        change: Of temperature [K].
    """

    points: NDArray[np.float64]
    displacement: NDArray[np.float64]
    change: float

    def write(self, path: Path) -> None:
        """Write a file that ``read`` reads."""
        np.savez(path, points=self.points, displacement=self.displacement, change=self.change)

    @classmethod
    def read(cls, path: Path) -> "Cooling":
        """Read what ``write`` wrote."""
        with np.load(path) as arrays:
            return cls(arrays["points"], arrays["displacement"], float(arrays["change"]))

    def check(self, whole: Whole) -> None:
        """Compare with a mesh.

        Raises:
            MeshError: It is another one.
        """
        points = whole.mesh.points
        size = float(np.ptp(points, axis=0).max())
        if points.shape != self.points.shape or np.abs(points - self.points).max() > SAME * size:
            raise MeshError(
                f"the residual stress is that of a mesh with {len(self.points)} nodes, other than these {len(points)}:"
                " cooling and shock need the same fine joints"
            )


@dataclass(frozen=True, slots=True)
class InitialState:
    """How the models of a run begin.

    Attributes:
        displacement: Role -> ``(n, 3)`` [m] of the model's nodes, in its numbers.
        change: Of temperature [K].
        path: Whether any element of the run yields or turns.
    """

    displacement: Mapping[Role, NDArray[np.float64]]
    change: float
    path: bool

    @classmethod
    def of(
        cls, cooling: Cooling, whole: Whole, inputs: Mapping[Role, ModelInput[TablesT_co]], path: bool
    ) -> "InitialState":
        """Take each model's nodes from those of the whole mesh; errors as ``Cooling.check``."""
        cooling.check(whole)
        displacement = {}
        for role, item in inputs.items():
            displacement[role] = np.zeros((item.tables.nodes, 3))
            displacement[role][item.mesh.cells] = cooling.displacement[whole.mesh.cells[item.cells]]
        return cls(displacement, cooling.change, path)

    def begin(self, role: Role, body: Body, materials: Sequence[Material]) -> Body:
        """Return a body that begins in this state; collective over its model.

        Args:
            role: Of the model.
            body: At rest, free of stress.
            materials: Material of each index of its elements.
        """
        displacement = np.ascontiguousarray(self.displacement[role][body.local.nodes])
        return begun(body, materials, displacement, self.change, self.path)


def begun(
    body: Body, materials: Sequence[Material], displacement: NDArray[np.float64], change: float, path: bool
) -> Body:
    """Return a body that begins with the stress of cooling; collective over its model.

    Args:
        body: At rest, free of stress.
        materials: Material of each index of its elements.
        displacement: ``(n, 3)`` [m] of cooling.
        change: Of temperature [K].
        path: Whether elements of any model yield or turn.
    """
    initial = mean_stress(body, materials, displacement, change)
    begin = partial(begin_path, materials=materials, displacement=displacement, change=change)
    body = replace(body, initial_stress=initial, begin=begin)
    return with_forces(body, materials, displacement, change) if path else body


def mean_stress(
    body: Body, materials: Sequence[Material], displacement: NDArray[np.float64], change: float
) -> NDArray[np.float64]:
    """Return the elastic mean stress ``(ne, 6)`` [Pa] of all elements after a change of temperature [K]."""
    elements = body.elements
    expansion = free_expansion(materials, change)[elements.material]
    straining = displacement[elements.cells] - expansion[:, None] * elements.points[elements.cells]
    return element_stress(body.geometry.gradient, elements.elasticity[elements.material], straining)


def with_forces(body: Body, materials: Sequence[Material], displacement: NDArray[np.float64], change: float) -> Body:
    """Return a body whose elements bear their stress, but for the sums of their forces at the interface; collective."""
    linear = [term for term in body.terms if not isinstance(term, NonlinearElements)]
    chosen = np.ones(len(body.elements.cells), dtype=bool)
    for term in body.terms:
        if isinstance(term, NonlinearElements):
            chosen[term.numbers] = False
            begin_path(term, materials, displacement, change)
    pretension = pretension_of(body, chosen, linear, (materials, displacement, change))
    terms = [*body.terms, pretension]
    leave_out_interface(body, terms, pretension)
    return replace(body, terms=terms)


def begin_path(
    term: NonlinearElements, materials: Sequence[Material], displacement: NDArray[np.float64], change: float
) -> None:
    """Give elements with a path the stress and plastic strain of their points; lanes that repeat one get them, too."""
    points = HenckyElements.build(term.elements, materials, free_expansion(materials, change)).points(displacement)
    order, state = term.lanes.element, by_lane(term.history["state"])
    state[..., :6] = points.stress[order]
    state[..., 6] = points.plastic_strain[order]
    if "hourglass" in term.history:
        term.history["hourglass"][...] = points.hourglass_energy[order]
    if "slip" in term.history:
        by_lane(term.history["slip"])[...] = -in_modes(points.stretched)[order]


def pretension_of(
    body: Body,
    chosen: NDArray[np.bool_],
    linear: Sequence[ForceTerm],
    cooled: tuple[Sequence[Material], NDArray[np.float64], float],
) -> Pretension:
    """Return force and energy of linear elements at no displacement of the shock.

    Args:
        body: The body.
        chosen: ``(ne,)`` its linear elements.
        linear: Their terms.
        cooled: Materials, displacement ``(n, 3)`` [m] of cooling, change of temperature [K].
    """
    materials, displacement, change = cooled
    expanding = thermal_force(body, chosen, materials, change)
    force = np.zeros_like(displacement)
    for term in linear:
        term.add(displacement, force)
    strain = np.zeros((len(materials), 6))
    strain[:, :3] = free_expansion(materials, change)
    density = 0.5 * np.einsum("mi,mij,mj->m", strain, body.elements.elasticity, strain)[body.elements.material]
    held_back = float(density[chosen] @ body.geometry.volume[chosen])
    stored = held_back - float(np.vdot(displacement, expanding + 0.5 * force))
    return Pretension(-force - expanding, stored)


def leave_out_interface(body: Body, terms: Sequence[ForceTerm], pretension: Pretension) -> None:
    """Let the forces of all terms on nodes of the interface add up to zero; collective."""
    rest, force = np.zeros_like(pretension.force), np.zeros_like(pretension.force)
    for term in terms:
        term.add(rest, force)
    body.tie.gather(force)
    body.shared.add(force)
    here = body.interface[body.interface >= 0]
    here = here[body.shared.owned[here]]
    pretension.force[here] += force[here]
