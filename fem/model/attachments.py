"""Lumped masses and elastic supports attached to the elements of a model."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.fitted import FittedTable
from reflowshock.fem.forces.bedding import BeddedFacets
from reflowshock.fem.mesh.facet import spring_rates
from reflowshock.fem.model.assembly import RankElements
from reflowshock.fem.model.body import Body
from reflowshock.fem.parallel.local_mesh import LocalMesh
from reflowshock.fem.problem.fittings import Support


def beddings_of(local: LocalMesh, table: FittedTable, supports: Mapping[str, Support]) -> list[BeddedFacets]:
    """Return the elastic supports on the elements of this rank, one for each support with springs.

    Args:
        local: Mesh of this rank.
        table: ``FittedTable`` with the facets of each elastic support by name, equal on all ranks.
        supports: Support of the case file by name; must contain the names in the table.

    Returns:
        Force terms with the stiffness per area, cells and nodes of their facets; a list in the order of the table.
    """
    return [BeddedFacets.build(name, local, facets, supports[name].stiffness) for name, facets in table.bedded.items()]


def with_support_stiffness(rank_elements: RankElements, bedding: BeddedFacets) -> RankElements:
    """Return a copy of the elements with critical steps reduced by the stiffness of an elastic support.

    Args:
        rank_elements: Elements of this rank with their critical steps [s].
        bedding: Elastic support on facets of these elements.
    """
    elements, cells = rank_elements.elements, bedding.cells
    mass = elements.density[cells][:, None] * rank_elements.geometry.nodal_volume[cells]
    corners = rank_elements.local.points[bedding.facets]
    added_frequency = np.zeros(len(rank_elements.steps))  # squared circular frequency [1/s^2]
    rates = spring_rates(elements.cells[cells], bedding.facets, mass, corners, bedding.stiffness)
    np.add.at(added_frequency, cells, rates)
    return replace(rank_elements, steps=2.0 / np.sqrt((2.0 / rank_elements.steps) ** 2 + added_frequency))


def with_attachments(
    body: Body,
    nodes: NDArray[np.integer],
    masses: NDArray[np.float64],
    beddings: Sequence[BeddedFacets],
) -> Body:
    """Return a copy of a body with lumped masses and elastic supports added; collective.

    Args:
        body: Body without attachments.
        nodes: Nodes with a lumped mass in numbers of the input, shape (k,), the same on all ranks; the mass of slaves
            moves to their masters.
        masses: Lumped mass at each of these nodes, shape (k,) [kg].
        beddings: Elastic supports on this rank; may be empty.
    """
    column = np.zeros((len(body.mass), 3))
    local = body.local.locate(nodes)
    owned = np.flatnonzero(local >= 0)
    owned = owned[body.shared.owned[local[owned]]]
    column[local[owned]] = masses[owned, None]
    body.tie.gather(column)
    body.shared.add(column)
    lumped = float(column[body.shared.owned, 0].sum())
    return replace(body, mass=body.mass + column[:, 0], terms=[*body.terms, *beddings], lumped=lumped)
