"""Cases of molten solder alone: a drop, a joint, two drops, an oscillating drop; what does not fit together in them."""

from pydantic import Field

from reflowshock.effect import Switch
from reflowshock.particles.parameters.scenes import Drop, Drops, Fluid, Joint, Liquid, Oscillation
from reflowshock.particles.parameters.solder import Solder
from reflowshock.problem import Problem
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.stage import Pipeline, Stage, report_of


def _one_body(scene: str) -> Pipeline:
    """Reflow of one scene, and its report."""
    reflow = Stage("reflow", (scene, "solder", "gravity"), (), ("reflow/shape.h5", "reflow/particles.vtu"))
    return Pipeline((reflow, report_of("reflow")))


class SolderCase(Case):
    """Molten solder alone, without package and board; the table that names the kind holds its scene."""

    gravity: Switch = "auto"
    solder: Fluid = Field(default_factory=Fluid)

    @property
    def molten(self) -> Solder:
        """The solder as the solver takes it."""
        return self.decided[0]

    @property
    def decided(self) -> tuple[Solder, str]:
        """The solder as the solver takes it, and why it has its scheme; no words where the case says it."""
        from reflowshock.particles.parameters.scene_checks import with_scheme

        scene = getattr(self, self.kind)
        return with_scheme(scene, self.solder.resolve(scene, self.gravity), self.solder.numerics.scheme)


class DropCase(SolderCase):
    """A drop of solder on a wall or pad."""

    kind = "drop"
    stages = _one_body("drop")

    drop: Drop


class JointCase(SolderCase):
    """A joint of solder between two pads."""

    kind = "joint"
    stages = _one_body("joint")

    joint: Joint


class DropsCase(SolderCase):
    """Two drops that become one, or stay apart."""

    kind = "drops"
    stages = _one_body("drops")

    drops: Drops


class OscillationCase(Case):
    """A free drop that oscillates."""

    kind = "oscillation"
    stages = _one_body("oscillation")

    oscillation: Oscillation
    solder: Liquid = Liquid()

    @property
    def molten(self) -> Solder:
        """The liquid as the solver takes it."""
        return self.oscillation.resolve(self.solder)


def of_drop(case: DropCase) -> list[Problem]:
    """Find parameters that make no possible drop together."""
    from reflowshock.particles.parameters.scene_checks import drop_problems

    return drop_problems(case.drop, case.molten)


def of_joint(case: JointCase) -> list[Problem]:
    """Find parameters that make no possible joint together."""
    from reflowshock.particles.parameters.joint_checks import joint_problems

    return joint_problems(case.joint, case.molten)


def of_drops(case: DropsCase) -> list[Problem]:
    """Find parameters that make no possible pair together."""
    from reflowshock.particles.parameters.scene_checks import pair_problems

    return pair_problems(case.drops, case.molten)


def of_oscillation(case: OscillationCase) -> list[Problem]:
    """Find a drop that does not oscillate."""
    from reflowshock.particles.parameters.scene_checks import oscillation_problems

    return oscillation_problems(case.oscillation, case.molten)
