"""Internal force terms: the contract, and the choice of one for the elements of a mesh."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fem.element import Elements
from fem.force_assembled import AssembledElements
from fem.force_congruent import CongruentElements, is_box


class ForceTerm(Protocol):
    """A part of the internal force; a plastic solder or a contact would be another one."""

    def add(self, displacement: NDArray[np.float64], force: NDArray[np.float64]) -> None:
        """Add the term's force ``(n, 3)`` [N] at a displacement ``(n, 3)`` [m]; the internal force is subtracted."""


def elastic_terms(elements: Elements) -> list[ForceTerm]:
    """Return the force terms of linear elastic hexahedra: boxes share stiffnesses, all others are assembled."""
    box = is_box(elements.points[elements.cells])
    terms: list[ForceTerm] = []
    if box.any():
        terms.append(CongruentElements.build(elements.subset(box)))
    if not box.all():
        terms.append(AssembledElements.build(elements.subset(~box)))
    return terms
