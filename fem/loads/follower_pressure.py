"""Pressure on a surface that moves: normal to it, and on the area that it has, wherever it goes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.loads.load import Kept, Load, Loaded
from reflowshock.fem.loads.pulse import Pulse
from reflowshock.fem.mesh.facet import area_vectors
from reflowshock.fem.mesh.facet_areas import OutwardFacets
from reflowshock.fem.model.body import Body


@dataclass
class FollowerPressure(Load):
    """A pressure on facets at the places that their nodes have reached; for finite kinematics.

    Attributes:
        facets: ``(nf, m)`` local nodes of the facets of this rank's elements.
        sign: ``(nf,)`` +1 where the normal by the right-hand rule points outwards, else -1.
        pulse: Pressure [Pa], positive where it pushes into the body.
    """

    facets: NDArray[np.int32]
    sign: NDArray[np.float64]
    pulse: Pulse
    kept: ClassVar[Mapping[str, Kept]] = {"work": "sum", "_force": "nodes"}
    work: float = 0.0
    _force: NDArray[np.float64] = field(init=False)

    @classmethod
    def build(cls, body: Body, found: OutwardFacets, pulse: Pulse) -> "FollowerPressure":
        """Take the facets of this rank's elements."""
        here = body.local.locate_cells(found.cells) >= 0
        facets = found.facets[here]
        return cls(body.local.locate(facets.ravel()).reshape(facets.shape), found.sign[here], pulse)

    def add(self, motion: Loaded) -> None:
        """Add the force of the motion's time and place; collective."""
        body = motion.body
        areas = area_vectors(body.local.points[self.facets] + motion.displacement[self.facets])
        self._force = np.zeros_like(motion.force)
        np.add.at(self._force, self.facets, -self.pulse.value(motion.time) * self.sign[:, None, None] * areas)
        body.tie.gather(self._force)
        body.shared.add(self._force)
        motion.force += self._force

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract it from a copy."""
        force -= self._force

    def collect(self, motion: Loaded) -> None:
        """Add half a step's work."""
        owned = motion.body.shared.owned
        self.work += 0.5 * motion.step * float(np.sum((self._force * motion.velocity)[owned]))
