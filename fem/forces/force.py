"""Internal force terms: the contract, and the choice of one for the elements of a mesh.

A term is linear unless its material yields or the kinematics are finite. Linear boxes of equal shape and material share
one stiffness and are computed in rows along lines of nodes (``force_congruent``); other linear elements are assembled
into blocks of 3 x 3 (``force_assembled``). Hexahedra that stay elastic turn by any angle without a path
(``force_corotational``), boxes at a quarter of their linear speed.
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
    """A part of the internal force; one that has ``arrays`` can be part of ``kernels.levels.take_steps``."""

    @property
    def history(self) -> dict[str, NDArray]:
        """Return the arrays to write and restore in place for a restart; none where force follows from displacement."""

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Subtract the internal force ``(n, 3)`` [N] at a displacement ``(n, 3)`` [m].

        A term with a path takes the step from the displacement of the call before: call it exactly once a step.
        """

    def energy(self, displacement: NDArray[np.float64]) -> Energy:
        """Return the energies [J] of this rank's elements at the displacement of the latest ``add``."""


@runtime_checkable
class TermWithPath(ForceTerm, Protocol):
    """A force term that remembers."""

    def state(self, cells: NDArray[np.int64]) -> dict[str, Rows]:
        """Return the history by element, for a checkpoint; ``cells`` are the input numbers of the rank's elements."""

    def restore(self, state: Mapping[str, NDArray[np.float64]]) -> None:
        """Continue from the values of what ``state`` returned."""


def force_terms(
    elements: Elements,
    materials: Sequence[Material],
    kinematics: Kinematics = "small",
    step: float = np.inf,
    laws: "Mapping[int, Law]" = MappingProxyType({}),
) -> list[ForceTerm]:
    """Return the force terms of elements: linear ones, and one with a path where the problem calls for it.

    Args:
        elements: The elements.
        materials: Material of each index of ``elements.elasticity``.
        kinematics: Small, corotational or finite.
        step: dt [s], of laws that depend on the rate; infinity stands for slow.
        laws: Index of ``elements.elasticity`` -> law in UFL that stands in the place of this material.
    """
    own = ~np.isin(elements.material, list(laws))
    return terms_of(elements, own, materials, kinematics, step) + ufl_terms(elements, laws)


def terms_of(
    elements: Elements, own: NDArray[np.bool_], materials: Sequence[Material], kinematics: Kinematics, step: float
) -> list[ForceTerm]:
    """Return the force terms of those elements that are ``own (ne,)``; other arguments as ``force_terms``."""
    plastic = np.array([plastic_constants(material) for material in materials])
    elastic = own & ~np.isfinite(plastic[elements.material, FIRST_YIELD])
    linear = elastic if kinematics == "small" else np.zeros_like(elastic)
    turning = elastic if kinematics == "corotational" and elements.cells.shape[1] == 8 else np.zeros_like(elastic)
    path = own & ~linear & ~turning
    terms = linear_terms(elements.subset(linear))
    terms += corotational_terms(elements, turning)
    if path.any():
        finite = kinematics != "small"
        terms.append(NonlinearElements.build(elements, np.flatnonzero(path), plastic, Path(finite, step)))
    return terms


def ufl_terms(elements: Elements, laws: "Mapping[int, Law]") -> list[ForceTerm]:
    """Return a force term for each law in UFL that elements of this rank have; arguments as ``force_terms``."""
    here = {index: np.flatnonzero(elements.material == index) for index in laws}
    if not any(map(len, here.values())):
        return []
    from reflowshock.fem.forces.force_ufl import UflElements  # which loads the compiler of forms

    return [UflElements(elements, chosen, laws[index]) for index, chosen in here.items() if len(chosen)]


def linear_terms(elements: Elements) -> list[ForceTerm]:
    """Return the force terms of elements that stay elastic and turn little: boxes share stiffnesses."""
    box = in_rows(elements)
    terms: list[ForceTerm] = []
    if box.any():
        terms.append(CongruentElements.build(elements.subset(box)))
    if not box.all():
        terms.append(AssembledElements.build(elements.subset(~box)))
    return terms
