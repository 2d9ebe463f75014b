"""Follower pressure: normal to the deformed surface and acting on its deformed area."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.loads.load import Checkpointed, Load, Loaded
from reflowshock.fem.loads.pulse import Pulse
from reflowshock.fem.mesh.facet import area_vectors
from reflowshock.fem.mesh.facet_areas import OutwardFacets
from reflowshock.fem.model.body import Body


@dataclass
class FollowerPressure(Load):
    """Pressure on facets in the deformed state, for finite kinematics.

    Attributes:
        facets: Local nodes of the facets of this rank's elements, shape (nf, m).
        sign: +1 where the right-hand normal points outwards, else -1, shape (nf,).
        pulse: Pressure [Pa], positive if it pushes into the body.
    """

    facets: NDArray[np.int32]
    sign: NDArray[np.float64]
    pulse: Pulse
    checkpointed: ClassVar[Mapping[str, Checkpointed]] = {"work": "sum", "_force": "nodes"}
    work: float = 0.0
    _force: NDArray[np.float64] = field(init=False)

    @classmethod
    def build(cls, body: Body, outward: OutwardFacets, pulse: Pulse) -> "FollowerPressure":
        """Return the pressure on those of the facets that belong to elements of this rank."""
        here = body.local.locate_cells(outward.cells) >= 0
        facets = outward.facets[here]
        return cls(body.local.locate(facets.ravel()).reshape(facets.shape), outward.sign[here], pulse)

    def add(self, motion: Loaded) -> None:
        """Add the pressure forces at the time and displacement of the motion; collective."""
        body = motion.body
        areas = area_vectors(body.local.points[self.facets] + motion.displacement[self.facets])
        self._force = np.zeros_like(motion.force)
        np.add.at(self._force, self.facets, -self.pulse.value(motion.time) * self.sign[:, None, None] * areas)
        body.tie.gather(self._force)
        body.shared.add(self._force)
        motion.force += self._force

    def remove(self, force: NDArray[np.float64]) -> None:
        """Subtract the force of the latest ``add`` from a copy of the motion's force."""
        force -= self._force

    def collect(self, motion: Loaded) -> None:
        """Add the work of half a step."""
        owned = motion.body.shared.owned
        self.work += 0.5 * motion.step * float(np.sum((self._force * motion.velocity)[owned]))
