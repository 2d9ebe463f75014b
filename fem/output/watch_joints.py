"""History values of a package on a board: centres, joints, board strain, watch points and gauges."""

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.division.tables import JointTables
from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.elements.stress import principal_strain
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.joint_elements import JointElements
from reflowshock.fem.model.stress_recovery import StressRecovery
from reflowshock.fem.output.joint_sections import JointSections, section_values
from reflowshock.fem.output.watch_points import PointWatch
from reflowshock.fem.parallel.local_mesh import positions
from reflowshock.fem.problem.shock import Damping

NO_DAMPING = Damping()
STRESSES = ("von_mises_board", "von_mises_package")
FLOWS = ("plastic_strain_board", "plastic_strain_package", "plastic_work_board", "plastic_work_package")


class JointWatch:
    """Watch points of a package on one rank: centres, joints, board strain and gauges; implements ``history.Watch``."""

    def __init__(
        self,
        tables: JointTables,
        body: Body,
        yields: bool,
        damping: Damping = NO_DAMPING,
        turning: bool = False,
    ) -> None:
        """Select this rank's share of the tables.

        Args:
            tables: Tables of the model.
            body: Model on this rank.
            yields: Whether the solder of the run may yield.
            damping: Rayleigh damping.
            turning: Whether rotations are finite.
        """
        self._yields, self._table = yields, tables.watch
        self._points = PointWatch(tables.fitted.points, body, turning)
        table, local = tables.watch, body.local
        self.joints = table.joints
        self.labels: dict[str, NDArray] = {
            "joints": np.array(table.joints, dtype=str),
            "joint_layer": np.array(table.thickness),
            **self._points.labels,
        }
        centres = local.locate(table.centres)
        self._centres = [(k, int(node)) for k, node in enumerate(centres) if node >= 0 and body.shared.owned[node]]
        solder = local.locate_cells(table.solder_cells)
        self._joint, solder = table.solder_joint[solder >= 0], solder[solder >= 0]
        self._recovery = StressRecovery(body, solder)
        layer, bearing = local.locate_cells(table.layer.cells), local.locate_cells(table.faces.cells)
        in_layer = layer >= 0
        chosen = np.unique(np.concatenate([layer[in_layer], bearing[bearing >= 0]]))
        self._elements = JointElements(body, chosen, tables.level[local.cell_numbers])
        self._sections = JointSections(tables, body, self._elements, *damping.coefficients)
        end, joint = np.divmod(table.layer.slot[in_layer], max(len(table.joints), 1))
        row = positions(chosen, layer[in_layer])
        self._weight, self._layer_joint = np.zeros((2, len(chosen), 8)), np.zeros(len(chosen), np.int64)
        self._weight[end, row], self._layer_joint[row] = table.layer.weight[in_layer], joint
        facets = table.strain_facets[local.locate_cells(table.strain_cells) >= 0]
        self._facets = local.locate(facets.ravel()).reshape(-1, 4)
        self._corners = local.points[self._facets][:, :, :2]

    def sample(self, motion: Motion) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return this rank's contributions to sums and maxima; collective if the body has local time steps.

        Returns:
            Sums: centres (6) [m], the sums of ``PointWatch`` and ``JointSections``, then integrals over the layers of
            von Mises stress [N m], plastic strain [m^3] and plastic work [J] for each end and joint. Maxima: von Mises
            stress [Pa] and plastic strain of each joint, largest and negative smallest strain of the board.
        """
        displacement = motion.displacement - motion.base_displacement()
        centres = np.zeros((2, 3))
        for k, node in self._centres:
            centres[k] = displacement[node]
        sections = self._sections.sums(motion)
        integrals = self._elements.integrals(self._weight)[: 3 if self._yields else 1]
        joints = [np.bincount(self._layer_joint, values, len(self.joints)) for part in integrals for values in part]
        points, _ = self._points.sample(motion)
        return np.concatenate([centres.ravel(), points, sections, *joints]), self._maxima(displacement)

    def row(self, sums: NDArray[np.float64], maxima: NDArray[np.float64]) -> dict[str, NDArray[np.float64] | float]:
        """Return the values of a sample by name, from the reduced sums and maxima."""
        layers = STRESSES + FLOWS if self._yields else STRESSES
        largest = ("von_mises_max", "plastic_strain_max") if self._yields else ("von_mises_max",)
        ends = [6, 6 + self._points.size, len(sums) - len(layers) * len(self.joints)]
        centres, points, sections, integrals = np.split(sums, ends)
        means = integrals.reshape(len(layers) // 2, -1) / self._table.layer.volume
        return {
            "board_centre": centres[:3],
            "die_centre": centres[3:],
            "board_strain": max(maxima[-2:]),
            **dict(zip(largest, maxima[:-2].reshape(len(largest), -1), strict=True)),
            **dict(zip(layers, means.reshape(len(layers), -1), strict=True)),
            **section_values(sections, self._table.faces),
            **self._points.row(points, maxima),
        }

    def _maxima(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        values = [self._recovery.mises(displacement)]
        if self._yields:
            values.append(self._recovery.plastic_strain())
        joints = np.zeros((len(values), len(self.joints)))
        for row, value in zip(joints, values, strict=True):
            np.maximum.at(row, self._joint, value)
        strains = np.zeros(2)
        if len(self._facets):
            largest, smallest = principal_strain(self._corners, displacement[self._facets][:, :, :2])
            strains[:] = largest.max(), -smallest.min()
        return np.concatenate([joints.ravel(), strains])
