"""What is attached to the elements of a model: lumped masses and elastic supports."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.forces.bedding import BeddedFacets
from reflowshock.fem.model.assembly import Pieces
from reflowshock.fem.model.body import Body


def bedded_steps(pieces: Pieces, bedding: BeddedFacets) -> Pieces:
    """Return the elements of a rank with the critical steps that they have on their springs.

    A facet's springs count in its element alone, as stiff as their row sums: no mode is then faster than the fastest
    element, whose omega^2 = 4 / dt^2 grows by at most the largest ratio of spring and mass at its nodes.
    """
    elements, cells = pieces.elements, bedding.cells
    at_facet = (elements.cells[cells][:, None, :] == bedding.facets[:, :, None]).argmax(axis=2)
    volume = np.take_along_axis(pieces.geometry.nodal_volume[cells], at_facet, axis=1)
    mass = elements.density[cells][:, None] * volume
    faster = np.zeros(len(pieces.steps))
    np.add.at(faster, cells, bedding.stiffness.max() * (bedding.largest / mass).max(axis=1))
    return replace(pieces, steps=2.0 / np.sqrt((2.0 / pieces.steps) ** 2 + faster))


def attached(
    body: Body, masses: tuple[NDArray[np.integer], NDArray[np.float64]], beddings: Sequence[BeddedFacets]
) -> Body:
    """Return a body with lumped masses and elastic supports; collective.

    Args:
        body: The body.
        masses: Nodes ``(k,)`` in input numbers and what each bears ``(k,)`` [kg]; of slaves it moves to their masters.
        beddings: Of this rank.
    """
    column = np.zeros((len(body.mass), 3))
    local = body.local.locate(masses[0])
    here = np.flatnonzero(local >= 0)
    here = here[body.shared.owned[local[here]]]
    column[local[here]] = masses[1][here, None]
    body.tie.gather(column)
    body.shared.add(column)
    return replace(body, mass=body.mass + column[:, 0], terms=[*body.terms, *beddings])
