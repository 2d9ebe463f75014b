"""Cases of a liquid that flows: a dam break, a channel, vortices; what does not fit together in them."""

from typing import Any

from reflowshock.particles.parameters.flows import DamBreak, Poiseuille, SphFlow, TaylorGreen
from reflowshock.problem import Problem
from reflowshock.units import from_si
from reflowshock.workflow.case.case import Case
from reflowshock.workflow.case.stage import Pipeline, Stage, report_of

LARGEST_REYNOLDS = 1000.0  # of vortices and channels: beyond they are turbulent, and no exact solution holds


def _flow_of(scene: str) -> Pipeline:
    """The flow of one scene, and its report."""
    particles = Stage("particles", (scene,), (), ("particles/flow.h5", "particles/particles.vtu"))
    return Pipeline((particles, report_of("particles")))


class FlowCase(Case):
    """A liquid that flows; the table that names the kind holds its scene."""

    @property
    def scene(self) -> Any:
        """The flow."""
        return getattr(self, self.kind)


class DamBreakCase(FlowCase):
    """A column of liquid in a tank is let go."""

    kind = "dam_break"
    stages = _flow_of("dam_break")

    dam_break: DamBreak


class PoiseuilleCase(FlowCase):
    """Liquid between two plates is set in motion."""

    kind = "poiseuille"
    stages = _flow_of("poiseuille")

    poiseuille: Poiseuille


class TaylorGreenCase(FlowCase):
    """Vortices in a periodic box."""

    kind = "taylor_green"
    stages = _flow_of("taylor_green")

    taylor_green: TaylorGreen


def of_dam_break(case: DamBreakCase) -> list[Problem]:
    """Find a column that does not fit in its tank, and a sensor that is not at its wall."""
    dam, found = case.dam_break, []
    if dam.width > dam.tank_length - dam.spacing:
        allowed = f"> dam_break.width = {metres(dam.width)}"
        found.append(
            Problem("dam_break.tank_length", "leaves the column no way to flow", metres(dam.tank_length), allowed)
        )
    if dam.width < dam.spacing:
        allowed = f">= {metres(dam.spacing)}, the spacing of the particles"
        found.append(Problem("dam_break.width", "is less than one particle", metres(dam.width), allowed))
    if dam.sensor_height > 4.0 * dam.height:
        allowed = f"<= {metres(4.0 * dam.height)}, 4 times dam_break.height"
        found.append(Problem("dam_break.sensor_height", "is above the tank's wall", metres(dam.sensor_height), allowed))
    return found


def of_viscous(case: FlowCase) -> list[Problem]:
    """Find a Reynolds number at which the exact solution is none that is seen, and viscosity that is left out."""
    scene: SphFlow = case.scene
    found = []
    if scene.reynolds > LARGEST_REYNOLDS:
        least = scene.viscosity * scene.reynolds / LARGEST_REYNOLDS
        message = f"makes the Reynolds number {scene.reynolds:.3g}, at which the exact flow is not stable"
        found.append(
            Problem(
                f"{case.kind}.viscosity",
                message,
                from_si(scene.viscosity, "Pa*s", digits=3),
                ">= " + from_si(least, "Pa*s", digits=3),
            )
        )
    if scene.effects.viscosity == "off":
        message = "without viscosity nothing is left of this flow"
        found.append(Problem(f"{case.kind}.effects.viscosity", message, "off", "auto, on"))
    return found


def metres(length: float) -> str:
    """Write a length [m]."""
    return from_si(length, "m", digits=3)
