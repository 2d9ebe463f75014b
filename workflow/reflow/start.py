"""Where a coupled reflow begins: what is small, how stiff the joints are, at which height a package floats."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.particles.parameters.solder import Solder
from reflowshock.workflow.reflow.coupling import Coupled, Scale
from reflowshock.workflow.reflow.rigid_balance import RigidBalance

if TYPE_CHECKING:
    from reflowshock.fem.statics.state import RigidModes
    from reflowshock.particles.core.geometry import JointGeometry

LONGEST_MOTION = 0.1  # of the smallest gap, in one exchange
SAMPLES = 41  # heights at which a package that floats is tried


def scale_of(geometries: "Sequence[JointGeometry]", solder: Solder, modes: "RigidModes", tolerance: float) -> Scale:
    """Return what is small: forces over pi a gamma, moments over that times the pad's radius a."""
    radii = np.array([(geometry.radius_board, geometry.radius_package) for geometry in geometries])
    force = np.pi * radii * solder.surface_tension
    pull = np.repeat(np.stack((force, force * radii), axis=-1), 3, axis=-1)
    way = np.linalg.norm(modes.pad_motion[:, :, 1, :3], axis=-1)
    turn = np.linalg.norm(modes.pad_motion[:, :, 1, 3:], axis=-1) * radii[:, 1]
    return Scale(pull, (np.maximum(way, turn) * force[:, 1]).sum(axis=1), tolerance)


def start(geometries: "Sequence[JointGeometry]", solder: Solder, modes: "RigidModes") -> Coupled:
    """Return where the coupling begins: without wrenches, a package that floats at the height that bears it.

    Args:
        geometries: of the joints between the pads as they would be without solder.
        solder: of one joint.
        modes: free rigid motions of the package.
    """
    from reflowshock.particles.scenes.carried_joint import stiffness_estimate

    gaps = np.array([geometry.gap for geometry in geometries])
    middle = geometries[int(np.argsort(gaps)[len(gaps) // 2])]
    stiffness = np.broadcast_to(stiffness_estimate(middle, solder), (len(gaps), 6, 6))
    largest = LONGEST_MOTION * float(gaps.min())
    balance = RigidBalance.start(modes.names, modes.pad_motion, stiffness, largest)
    rigid = np.zeros(len(modes.names))
    if "z" in modes.names:
        number = modes.names.index("z")
        rigid[number] = floating_height(middle, solder, -modes.weight[number] / len(gaps)) - middle.gap
    return Coupled(np.zeros((len(gaps), 2, 6)), rigid, balance)


def floating_height(geometry: "JointGeometry", solder: Solder, load: float) -> float:
    """Return the gap [m] nearest to the given one at which a coaxial joint bears a load [N]; this one where none does.

    A higher joint must bear less, or the height does not last.
    """
    from scipy.optimize import brentq

    from reflowshock.particles.scenes.carried_joint import axial_force

    def excess(gap: float) -> float:
        return axial_force(geometry, solder, gap) - load

    gaps = geometry.gap * np.linspace(0.4, 1.6, SAMPLES)
    left = np.array([excess(gap) for gap in gaps])
    found = np.flatnonzero((left[:-1] > 0.0) & (left[1:] <= 0.0))
    if not len(found):
        return geometry.gap
    first = found[np.argmin(np.abs(gaps[found] - geometry.gap))]
    return float(brentq(excess, gaps[first], gaps[first + 1], rtol=1e-6))
