"""Internal force terms: their interface, and the terms of the elements of a mesh.

A term is linear unless its material yields or the kinematics are finite. Linear boxes of equal shape and material share
one stiffness and are computed in rows along lines of nodes (``force_congruent``); other linear elements are assembled
into blocks of 3 x 3 (``force_assembled``). Elastic hexahedra with finite rotations need no history
(``force_corotational``); boxes run at a quarter of their linear speed. All others are path-dependent
(``force_nonlinear``).
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.elements.element import Elements
from reflowshock.fem.forces.energy import Energy
from reflowshock.fem.forces.force_assembled import AssembledElements
from reflowshock.fem.forces.force_congruent import CongruentElements, in_rows
from reflowshock.fem.forces.force_corotational import corotational_terms
from reflowshock.fem.forces.force_nonlinear import NonlinearElements
from reflowshock.fem.kernels.nonlinear import Path
from reflowshock.fem.parallel.checkpoint_state import Rows
from reflowshock.fem.problem.kinematics import Kinematics
from reflowshock.materials.parameters import Material
from reflowshock.materials.plasticity import FIRST_YIELD, plastic_constants

if TYPE_CHECKING:
    from reflowshock.fem.forces.force_ufl import Law


class ForceTerm(Protocol):
    """Part of the internal force; terms with the attribute ``arrays`` can be used in ``kernels.levels.take_steps``."""

    @property
    def history(self) -> dict[str, NDArray]:
        """Arrays by name that a restart restores in place; empty if the force follows from the displacement."""

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force ``(n, 3)`` [N] at a displacement ``(n, 3)`` [m].

        A path-dependent term takes a step from the displacement of the previous call: call it exactly once per step.
        """

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the energies [J] of this rank's elements at the displacement of the latest ``add``."""


@runtime_checkable
class TermWithPath(ForceTerm, Protocol):
    """Path-dependent force term."""

    def state(self, cells: NDArray[np.int64]) -> dict[str, Rows]:
        """Return the history by element for a checkpoint; ``cells`` are the global numbers of this rank's elements."""

    def restore(self, state: Mapping[str, NDArray[np.float64]]) -> None:
        """Set the history from the values that ``state`` returned."""


def force_terms(
    elements: Elements,
    materials: Sequence[Material],
    kinematics: Kinematics = "small",
    step: float = np.inf,
    laws: "Mapping[int, Law]" = MappingProxyType({}),
) -> list[ForceTerm]:
    """Return the force terms of elements: linear ones, and a path-dependent one where material or kinematics need it.

    Args:
        elements: Elements of this rank.
        materials: Material of each index of ``elements.elasticity``, nm of them.
        kinematics: "small", "corotational" (finite rotations, small elastic strains) or "finite" strains.
        step: Time step of rate-dependent laws [s]; infinity means quasi-static.
        laws: UFL laws by index of ``elements.elasticity``, which replace the materials; empty without UFL.

    Returns:
        Terms whose sum is the internal force; empty without elements.
    """
    library = ~np.isin(elements.material, list(laws))
    return terms_of(elements, library, materials, kinematics, step) + _ufl_terms(elements, laws)


def terms_of(
    elements: Elements, chosen: NDArray[np.bool_], materials: Sequence[Material], kinematics: Kinematics, step: float
) -> list[ForceTerm]:
    """Return the force terms of selected elements, without UFL laws: linear, corotational and path-dependent ones.

    The terms use the node and element numbers of all elements.

    Args:
        elements: Elements of this rank.
        chosen: Whether an element is selected, shape (ne,).
        materials: Material of each index of ``elements.elasticity``.
        kinematics: "small", "corotational" (finite rotations, small elastic strains) or "finite" strains.
        step: Time step of rate-dependent laws [s]; infinity means quasi-static.
    """
    plastic = np.array([plastic_constants(material) for material in materials])
    elastic = chosen & ~np.isfinite(plastic[elements.material, FIRST_YIELD])
    linear = elastic if kinematics == "small" else np.zeros_like(elastic)
    turning = elastic if kinematics == "corotational" and elements.cells.shape[1] == 8 else np.zeros_like(elastic)
    path = chosen & ~linear & ~turning
    terms = linear_terms(elements.subset(linear))
    terms += corotational_terms(elements, turning)
    if path.any():
        finite = kinematics != "small"
        terms.append(NonlinearElements.build(elements, np.flatnonzero(path), plastic, Path(finite, step)))
    return terms


def _ufl_terms(elements: Elements, laws: "Mapping[int, Law]") -> list[ForceTerm]:
    """Return a force term for each UFL law with elements on this rank; arguments as ``force_terms``."""
    here = {index: np.flatnonzero(elements.material == index) for index in laws}
    if not any(map(len, here.values())):
        return []
    from reflowshock.fem.forces.force_ufl import UflElements  # imports the form compiler only when needed

    return [UflElements(elements, chosen, laws[index]) for index, chosen in here.items() if len(chosen)]


def linear_terms(elements: Elements) -> list[ForceTerm]:
    """Return the force terms of linear elastic elements at small rotations: one for boxes, one for all others.

    Args:
        elements: Elements of this rank; without any, the list is empty.
    """
    box = in_rows(elements)
    terms: list[ForceTerm] = []
    if box.any():
        terms.append(CongruentElements.build(elements.subset(box)))
    if not box.all():
        terms.append(AssembledElements.build(elements.subset(~box)))
    return terms
