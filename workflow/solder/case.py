"""Cases of molten solder alone, and their checks: a drop, a joint, two drops, an oscillating drop."""

from typing import ClassVar

from pydantic import Field

from reflowshock.effect import Switch
from reflowshock.particles.parameters.scenes import Drop, Drops, Fluid, Joint, Liquid, Oscillation
from reflowshock.particles.parameters.solder import Solder
from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.stage import Pipeline, Stage, report_of


def _pipeline(scene: str) -> Pipeline:
    """Return the pipeline of a scene: its reflow and the report."""
    reflow = Stage("reflow", (scene, "solder", "gravity"), (), ("reflow/shape.h5", "reflow/particles.vtu"))
    return Pipeline((reflow, report_of("reflow")))


class SolderCase(Case):
    """Case of molten solder without package and board; the table that names its kind is the scene.

    Attributes:
        is_centred: Whether the body stands around the z axis.
    """

    is_centred: ClassVar[bool] = True

    gravity: Switch = "auto"
    solder: Fluid = Field(default_factory=Fluid)

    @property
    def molten(self) -> Solder:
        """Parameters of the solder for the solver."""
        return self.decided[0]

    @property
    def is_plane(self) -> bool:
        """Whether the scene is a plane section, the same along y."""
        return False

    @property
    def decided(self) -> tuple[Solder, str]:
        """Parameters of the solder for the solver, and the reason for its scheme; empty if the case sets the scheme."""
        from reflowshock.particles.parameters.scene_checks import with_scheme

        scene = getattr(self, self.kind)
        return with_scheme(scene, self.solder.resolve(scene, self.gravity), self.solder.numerics.scheme)


class DropCase(SolderCase):
    """Case of a drop of solder on a wall or pad, or without a wall."""

    kind = "drop"
    stages = _pipeline("drop")

    drop: Drop

    @property
    def is_plane(self) -> bool:
        """Whether the drop is a plane section, the same along y."""
        return self.drop.section == "plane"


class JointCase(SolderCase):
    """Case of a joint of solder between two pads."""

    kind = "joint"
    stages = _pipeline("joint")

    joint: Joint


class DropsCase(SolderCase):
    """Case of two drops that merge or stay apart."""

    kind = "drops"
    is_centred = False
    stages = _pipeline("drops")

    drops: Drops


class OscillationCase(Case):
    """Case of a free drop that oscillates."""

    kind = "oscillation"
    stages = _pipeline("oscillation")

    oscillation: Oscillation
    solder: Liquid = Liquid()

    @property
    def molten(self) -> Solder:
        """Parameters of the liquid for the solver."""
        return self.oscillation.resolve(self.solder)


def check_drop(case: DropCase) -> list[Problem]:
    """Find contradictions between the parameters of a drop: its scene (size, wall, particles) and its solder.

    Args:
        case: Case of a drop at rest.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    from reflowshock.particles.parameters.scene_checks import drop_problems

    return drop_problems(case.drop, case.molten)


def check_joint(case: JointCase) -> list[Problem]:
    """Find contradictions between the parameters of a joint: pads, volume, motion of the package, and solder.

    Args:
        case: Case of a single joint.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    from reflowshock.particles.parameters.joint_checks import joint_problems

    return joint_problems(case.joint, case.molten)


def check_drops(case: DropsCase) -> list[Problem]:
    """Find contradictions between the parameters of two drops: their scene and their solder.

    Args:
        case: Case of two drops that merge or stay apart.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    from reflowshock.particles.parameters.scene_checks import pair_problems

    return pair_problems(case.drops, case.molten)


def check_oscillation(case: OscillationCase) -> list[Problem]:
    """Find parameters with which a drop would not oscillate, such as too much viscosity.

    Args:
        case: Case of an oscillating drop.

    Returns:
        One ``Problem`` (dotted key, message, value, allowed values) for each error found; empty for a valid case.
    """
    from reflowshock.particles.parameters.scene_checks import oscillation_problems

    return oscillation_problems(case.oscillation, case.molten)
