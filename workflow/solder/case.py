"""Cases of molten solder alone: a drop, a joint, two drops, a drop that swings."""

from pydantic import Field

from reflowshock.particles.parameters.scenes import Drop, Drops, Fluid, Joint, Liquid, Oscillation
from reflowshock.particles.parameters.solder import Solder, Switch
from reflowshock.workflow.case.kind import Case, of_particles
from reflowshock.workflow.case.problems import Problem
from reflowshock.workflow.case.stage_table import DROP, DROPS, JOINT, OSCILLATION


class SceneCase(Case):
    """Molten solder alone, without package and board; the table that names the kind holds its scene."""

    gravity: Switch = "auto"
    solder: Fluid = Field(default_factory=Fluid)

    @property
    def molten(self) -> Solder:
        """The solder as the solver takes it."""
        return self.solder.resolve(getattr(self, self.kind), self.gravity)


class DropCase(SceneCase):
    """A drop of solder on a wall or pad."""

    kind = "drop"
    stages = DROP

    drop: Drop

    def problems(self) -> list[Problem]:
        """Find parameters that make no possible drop together."""
        from reflowshock.particles.parameters.scene_checks import drop_problems

        return of_particles(drop_problems(self.drop, self.molten))


class JointCase(SceneCase):
    """A joint of solder between two pads."""

    kind = "joint"
    stages = JOINT

    joint: Joint

    def problems(self) -> list[Problem]:
        """Find parameters that make no possible joint together."""
        from reflowshock.particles.parameters.scene_checks import joint_problems

        return of_particles(joint_problems(self.joint, self.molten))


class DropsCase(SceneCase):
    """Two drops that become one, or stay apart."""

    kind = "drops"
    stages = DROPS

    drops: Drops

    def problems(self) -> list[Problem]:
        """Find parameters that make no possible pair together."""
        from reflowshock.particles.parameters.scene_checks import pair_problems

        return of_particles(pair_problems(self.drops, self.molten))


class OscillationCase(Case):
    """A free drop that swings."""

    kind = "oscillation"
    stages = OSCILLATION

    oscillation: Oscillation
    solder: Liquid = Liquid()

    @property
    def molten(self) -> Solder:
        """The liquid as the solver takes it."""
        return self.oscillation.resolve(self.solder)

    def problems(self) -> list[Problem]:
        """Find a drop that does not swing."""
        from reflowshock.particles.parameters.scene_checks import oscillation_problems

        return of_particles(oscillation_problems(self.oscillation, self.molten))
