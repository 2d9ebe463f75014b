"""History values at watch points, strain gauges and supports."""

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.forces.bedding import BeddedFacets
from reflowshock.fem.mesh.point_table import COMPONENTS, PointTable
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.stress_recovery import StressRecovery


class PointWatch:
    """Watch points, gauges and supports on one rank; implements ``history.Watch``."""

    def __init__(self, table: PointTable, body: Body, turning: bool) -> None:
        """Select this rank's share of the table; ``turning`` says whether rotations are finite."""
        self._table, self._tie, self._turning = table, body.tie, turning
        self.labels: dict[str, NDArray] = {
            "watch": np.array(table.names, dtype=str),
            "watch_points": table.points,
            "strain_points": table.strain_points,
            "supports": np.array(list(table.supports), dtype=str),
            "gauges": np.array(table.gauges.names, dtype=str),
        }
        ends = body.local.locate(table.gauges.nodes)
        self._owned_ends = np.flatnonzero((ends >= 0) & body.shared.owned[ends])
        self._ends = ends[self._owned_ends]
        local = body.local.locate(table.nodes)
        owned = (local >= 0) & body.shared.owned[local]
        self._slots, self._nodes = np.flatnonzero(owned), local[owned]
        cells = body.local.locate_cells(table.cells)
        self._owner, self._weight = table.owner[cells >= 0], table.weight[cells >= 0]
        cells = cells[cells >= 0]
        self._recovery = StressRecovery(body, cells)
        supports = [(body.local.locate(nodes), held) for nodes, held in table.supports.values()]
        self._supports = [(nodes[(nodes >= 0) & body.shared.owned[nodes]], held) for nodes, held in supports]
        beddings = [term for term in body.terms if isinstance(term, BeddedFacets)]
        self._beddings = [[term for term in beddings if term.name == name] for name in table.supports]

    def sample(self, motion: Motion) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return this rank's contributions to the sums (points by quantity, gauges, reactions [N]), and no maxima."""
        parts = [self._value(quantity, motion).ravel() for quantity in self._table.quantities]
        return np.concatenate([*parts, self._stretches(motion).ravel(), *self._reactions(motion)]), np.empty(0)

    @property
    def size(self) -> int:
        """Number of sums."""
        table = self._table
        values = len(table.names) * sum(COMPONENTS[quantity] for quantity in table.quantities)
        return values + 3 * (len(table.gauges.names) + len(table.supports))

    def _stretches(self, motion: Motion) -> NDArray[np.float64]:
        """Return this rank's contribution to the relative displacements of all gauges, shape (g, 3) [m]."""
        gauges = self._table.gauges
        result = np.zeros((len(gauges.names), 3))
        moved = gauges.weight[self._owned_ends] * motion.displacement[self._ends]
        np.add.at(result, gauges.gauge[self._owned_ends], moved)
        return result

    def _reactions(self, motion: Motion) -> list[NDArray[np.float64]]:
        """Return this rank's contribution to the reaction of each support, shape (3,) [N]."""
        if not self._supports:
            return []
        reaction = motion.reaction()  # sum over all supports; supports share nodes where facet sets meet
        sums = [held * reaction[nodes].sum(axis=0) for nodes, held in self._supports]
        for total, beddings in zip(sums, self._beddings, strict=True):
            for bedding in beddings:
                total += bedding.force(motion.displacement).sum(axis=0)
        return sums

    def _value(self, quantity: str, motion: Motion) -> NDArray[np.float64]:
        """Return this rank's contribution to a quantity at all points."""
        result = np.zeros((len(self._table.names), COMPONENTS[quantity]))
        if quantity == "displacement":
            result[self._slots] = motion.displacement[self._nodes] - motion.base_displacement()
        elif quantity == "velocity":
            velocity = motion.present_velocity()
            self._tie.spread(velocity)
            result[self._slots] = velocity[self._nodes] - motion.base_velocity()
        else:
            np.add.at(result, self._owner, self._weight[:, None] * self._mean(quantity, motion.displacement))
        return result

    def _mean(self, quantity: str, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the mean of a quantity in each of this rank's elements around the points."""
        if quantity == "strain":
            return self._recovery.strain(displacement)
        if quantity == "stress":
            return self._recovery.stress(displacement)
        return self._recovery.plastic_strain()[:, None]

    def row(self, sums: NDArray[np.float64], maxima: NDArray[np.float64]) -> dict[str, NDArray[np.float64] | float]:
        """Return ``<quantity>@<point>``, ``gauge@<gauge>`` and ``reaction@<support>`` from the reduced sums."""
        del maxima
        count, start = len(self._table.names), 0
        result: dict[str, NDArray[np.float64] | float] = {}
        for quantity in self._table.quantities:
            components = COMPONENTS[quantity]
            values = sums[start : start + count * components].reshape(count, components)
            result |= {f"{quantity}@{name}": value for name, value in zip(self._table.names, values, strict=True)}
            start += count * components
        gauges = self._table.gauges
        stretches, reactions = np.split(sums[start:].reshape(-1, 3), [len(gauges.names)])
        strains = gauges.strains(stretches, self._turning).tolist()
        result |= {f"gauge@{name}": strain for name, strain in zip(gauges.names, strains, strict=True)}
        return result | {f"reaction@{name}": value for name, value in zip(self._table.supports, reactions, strict=True)}
