"""What is watched of a package on a board: centres, joints, board strain."""

import numpy as np
from numpy.typing import NDArray

from fem.body import Body
from fem.local_mesh import positions
from fem.moving import Moving
from fem.stress import principal_strain, von_mises
from fem.stress_recovery import StressRecovery
from fem.watch_table import WatchTable

LAYERS = ("von_mises_board", "von_mises_package", "peel_board", "peel_package")


class JointWatch:
    """Centres of board and die, joints and board strain on one rank; a ``watch.Watch``."""

    def __init__(self, table: WatchTable, body: Body) -> None:
        """Find this rank's share of the table."""
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

    def sample(self, motion: Moving) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return this rank's parts.

        Returns:
            Sums: centres (6) [m], then von Mises and peel [Pa] per end and joint. Maxima: von Mises per joint [Pa],
            largest and minus smallest strain of the board.
        """
        displacement = motion.displacement - motion.base_displacement()
        stress = self._recovery.stress(displacement)
        return self._sums(displacement, stress), self._maxima(displacement, stress)

    def row(self, sums: NDArray[np.float64], maxima: NDArray[np.float64]) -> dict[str, NDArray[np.float64] | float]:
        """Name the parts that all ranks have combined."""
        layers = dict(zip(LAYERS, sums[6:].reshape(len(LAYERS), -1), strict=True))
        return {
            "board_centre": sums[:3],
            "die_centre": sums[3:6],
            "von_mises_max": maxima[:-2],
            "board_strain": max(maxima[-2:]),
        } | layers

    def _sums(self, displacement: NDArray[np.float64], stress: NDArray[np.float64]) -> NDArray[np.float64]:
        centres = np.zeros((2, 3))
        for k, node in self._centres:
            centres[k] = displacement[node]
        layer, slots = stress[self._layer], 2 * len(self.joints)
        mises = np.bincount(self._slot, self._volume * von_mises(layer), minlength=slots)
        peel = np.bincount(self._slot, self._area * layer[:, 2], minlength=slots)
        return np.concatenate([centres.ravel(), mises, peel])

    def _maxima(self, displacement: NDArray[np.float64], stress: NDArray[np.float64]) -> NDArray[np.float64]:
        result = np.zeros(len(self.joints) + 2)
        np.maximum.at(result, self._joint, von_mises(stress))
        if len(self._facets):
            largest, smallest = principal_strain(self._corners, displacement[self._facets][:, :, :2])
            result[-2:] = largest.max(), -smallest.min()
        return result
