"""What is attached to the elements of a model: lumped masses and elastic supports."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.fitted import FittedTable
from reflowshock.fem.forces.bedding import BeddedFacets
from reflowshock.fem.mesh.facet import spring_rates
from reflowshock.fem.model.assembly import Pieces
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.local_mesh import LocalMesh
from reflowshock.fem.problem.fittings import Support


def beddings_of(local: LocalMesh, table: FittedTable, supports: Mapping[str, Support]) -> list[BeddedFacets]:
    """Return the elastic supports on the elements of a rank."""
    return [BeddedFacets.build(name, local, found, supports[name].stiffness) for name, found in table.bedded.items()]


def bedded_steps(pieces: Pieces, bedding: BeddedFacets) -> Pieces:
    """Return the elements of a rank with the critical steps that they have on their springs."""
    elements, cells = pieces.elements, bedding.cells
    mass = elements.density[cells][:, None] * pieces.geometry.nodal_volume[cells]
    corners = pieces.local.points[bedding.facets]
    faster = np.zeros(len(pieces.steps))
    np.add.at(faster, cells, spring_rates(elements.cells[cells], bedding.facets, mass, corners, bedding.stiffness))
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
    lumped = float(column[body.shared.owned, 0].sum())
    return replace(body, mass=body.mass + column[:, 0], terms=[*body.terms, *beddings], lumped=lumped)
