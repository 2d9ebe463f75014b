"""Corners of the die that are moved: forces there hold the package at a height, and balance what its pads do not.

    [ A_cc  R_c ] [ force ]   [ wanted height - height without the forces ]
    [ R_c^T  0  ] [ rigid ] = [ - load along the motions that are held    ]

A_cc is the compliance of the corners without rigid motions, R_c what those do to the corners.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.statics.thermoelastic import Thermoelastic


@dataclass(frozen=True, slots=True)
class Corners:
    """Moved corners of a model on one rank; none where the package floats.

    Attributes:
        model: The model.
        nodes: ``(c,)`` local node of each corner, -1 where another rank owns it.
        fields: ``(c, n, 3)`` [m/N] displacement for a force upwards at each.
        motions: ``(k, n, 3)`` rigid motions of the package that the corners hold.
        held: ``(m,)`` whether they hold each of the package's motions.
        matrix: ``(c + k, c + k)`` as above.
    """

    model: Thermoelastic
    nodes: NDArray[np.int32]
    fields: NDArray[np.float64]
    motions: NDArray[np.float64]
    held: NDArray[np.bool_]
    matrix: NDArray[np.float64]

    @classmethod
    def of(cls, model: Thermoelastic, nodes: NDArray[np.int32], package: NDArray[np.float64]) -> "Corners":
        """Find what forces at corners do; collective.

        Args:
            model: The model.
            nodes: ``(c,)`` local node of each corner, -1 where this rank does not have it.
            package: ``(m, n, 3)`` free rigid motions of the package.
        """
        nodes = np.where((nodes >= 0) & model.body.shared.owned[nodes], nodes, -1)
        fields = np.array([model.displacement(push) for push in _pushes(nodes, package.shape[1])])
        fields = fields.reshape(len(nodes), *package.shape[1:])
        found = cls(model, nodes, fields, package, np.zeros(len(package), bool), np.empty((0, 0)))
        turned = np.array([found.heights(field) for field in package]).reshape(len(package), len(nodes)).T
        held = np.abs(turned).max(axis=0, initial=0.0) > 0.0
        across = turned[:, held]
        compliance = np.array([found.heights(field) for field in fields]).reshape(len(nodes), len(nodes)).T
        empty = np.zeros((across.shape[1], across.shape[1]))
        return cls(model, nodes, fields, package[held], held, np.block([[compliance, across], [across.T, empty]]))

    def heights(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far the corners move upwards in a displacement ``(n, 3)``: ``(c,)``, collective."""
        mine = np.where(self.nodes >= 0, displacement[self.nodes, 2], 0.0)
        return np.asarray(self.model.space.comm.allreduce(mine))

    def move(
        self, displacement: NDArray[np.float64], height: float, load: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Bring the corners to a height; collective.

        Args:
            displacement: ``(n, 3)`` [m] without the forces.
            height: [m].
            load: ``(m,)`` forces along the package's motions.

        Returns:
            The displacement with the forces, and the forces ``(c,)`` [N].
        """
        wanted = np.concatenate([height - self.heights(displacement), -load[self.held]])
        force, rigid = np.split(np.linalg.solve(self.matrix, wanted), [len(self.nodes)])
        moved = displacement + np.tensordot(force, self.fields, 1) + np.tensordot(rigid, self.motions, 1)
        return moved, force


def _pushes(nodes: NDArray[np.int32], count: int) -> NDArray[np.float64]:
    """Return forces of 1 N upwards at each node that this rank owns: ``(c, count, 3)``."""
    pushes = np.zeros((len(nodes), count, 3))
    mine = np.flatnonzero(nodes >= 0)
    pushes[mine, nodes[mine], 2] = 1.0
    return pushes
