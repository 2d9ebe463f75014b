"""What is watched of a package on a board: centres, joints, board strain."""

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.dynamics.motion import Motion
from reflowshock.fem.elements.stress import principal_strain, von_mises
from reflowshock.fem.mesh.watch_table import WatchTable
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.stress_recovery import StressRecovery
from reflowshock.fem.parallel.local_mesh import positions

LAYERS = ("von_mises_board", "von_mises_package", "peel_board", "peel_package")
FLOW_LAYERS = ("plastic_work_board", "plastic_work_package")


class JointWatch:
    """Centres of board and die, joints and board strain on one rank; a ``watch.Watch``."""

    def __init__(self, table: WatchTable, body: Body, yields: bool) -> None:
        """Find this rank's share of the table; ``yields`` says whether solder flows, in all models of a run alike."""
        self._yields = yields
        local = body.local
        self.joints = table.joints
        self.labels: dict[str, NDArray] = {"joints": np.array(table.joints, dtype=str)}
        centres = local.locate(table.centres)
        self._centres = [(k, int(node)) for k, node in enumerate(centres) if node >= 0 and body.shared.owned[node]]
        solder = local.locate_cells(table.solder_cells)
        self._joint, solder = table.solder_joint[solder >= 0], solder[solder >= 0]
        self._recovery = StressRecovery(body, solder)
        layer = local.locate_cells(table.layer_cells)
        here = layer >= 0
        self._layer = positions(solder.astype(np.int64), layer[here])
        self._slot = (table.layer_end * len(table.joints) + table.layer_joint)[here]
        self._volume, self._area = table.layer_volume[here], table.layer_area[here]
        facets = table.strain_facets[local.locate_cells(table.strain_cells) >= 0]
        self._facets = local.locate(facets.ravel()).reshape(-1, 4)
        self._corners = local.points[self._facets][:, :, :2]

    def sample(self, motion: Motion) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return this rank's parts.

        Returns:
            Sums: centres (6) [m], then von Mises, peel [Pa], plastic work density [J/m^3] per end and joint. Maxima:
            von Mises [Pa], plastic strain per joint, largest and minus smallest strain of the board.
        """
        displacement = motion.displacement - motion.base_displacement()
        stress = self._recovery.stress(displacement)
        return self._sums(displacement, stress), self._maxima(displacement, stress)

    def row(self, sums: NDArray[np.float64], maxima: NDArray[np.float64]) -> dict[str, NDArray[np.float64] | float]:
        """Name the parts that all ranks have combined."""
        layers = LAYERS + FLOW_LAYERS if self._yields else LAYERS
        joints = ("von_mises_max", "plastic_strain_max") if self._yields else ("von_mises_max",)
        return {
            "board_centre": sums[:3],
            "die_centre": sums[3:6],
            "board_strain": max(maxima[-2:]),
            **dict(zip(joints, maxima[:-2].reshape(len(joints), -1), strict=True)),
            **dict(zip(layers, sums[6:].reshape(len(layers), -1), strict=True)),
        }

    def _sums(self, displacement: NDArray[np.float64], stress: NDArray[np.float64]) -> NDArray[np.float64]:
        centres = np.zeros((2, 3))
        for k, node in self._centres:
            centres[k] = displacement[node]
        layer = stress[self._layer]
        values = [self._volume * von_mises(layer), self._area * layer[:, 2]]
        if self._yields:
            values.append(self._volume * self._recovery.plastic_work()[self._layer])
        slots = 2 * len(self.joints)
        return np.concatenate([centres.ravel(), *(np.bincount(self._slot, value, slots) for value in values)])

    def _maxima(self, displacement: NDArray[np.float64], stress: NDArray[np.float64]) -> NDArray[np.float64]:
        values = [von_mises(stress)]
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
