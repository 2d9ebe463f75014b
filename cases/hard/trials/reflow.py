"""Reflow trials: drops, joints, drop pairs and oscillations, checked by volume, energy, forces and exact shapes."""

from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import Field

from reflowshock.cases.hard.trial import Measured, Refused, Trial
from reflowshock.effect import Switch
from reflowshock.parameters import Parameters
from reflowshock.particles.parameters.scenes import Drop, Drops, Fluid, Joint, Liquid, Oscillation
from reflowshock.particles.parameters.solder import Solder

if TYPE_CHECKING:
    from reflowshock.particles.steps.flow import LiquidFlow
    from reflowshock.particles.steps.shape import JointShape

SHAPE = {
    "volume_drift": "",
    "energy_rise": "",
    "energy_over_start": "",
    "energy_imbalance": "",
    "capillary_number_at_rest": "",
    "particles_lost": "",
    "steps": "",
}
ERRORS_OF_DROP = {
    "height_error": "",
    "max_width_error": "",
    "contact_angle_error": "deg",
    "contact_angle_excess": "deg",
    "spread_max": "",
}
ERRORS_OF_PAIR = {"radius_error": "", "place_error": "", "drops_left": ""}
ERRORS_OF_JOINT = {
    "width_error": "",
    "waist_error": "",
    "axial_force_error": "",
    "force_balance_error": "",
    "collapse_height_error": "",
    "offset": "mm",
    "tilt": "deg",
    "places": "",
}


class MoltenScene(Parameters):
    """Solder scene; a Bond number rho g V^(2/3) / gamma replaces the acceleration of gravity.

    The solder must come to rest unless ``rest`` is false, where its process ends earlier.
    """

    gravity: Switch = "auto"
    solder: Fluid = Fluid()
    bond: float | None = Field(None, ge=0, le=100)
    rest: bool = True

    def molten(self, scene: Drop | Joint | Drops) -> Solder:
        """Return the solder in the form of the solvers."""
        from reflowshock.particles.parameters.scene_checks import with_scheme

        solder = self.solder.resolve(scene, self.gravity)
        if self.bond is not None:
            gravity = self.bond * solder.surface_tension / (solder.density * solder.volume ** (2.0 / 3.0))
            solder = solder.model_copy(update={"gravity": gravity})
        return with_scheme(scene, solder, self.solder.numerics.scheme)[0]

    def measured(self, shape: "JointShape") -> dict[str, Measured]:
        """Return all measures of a shape and of its energy history.

        Raises:
            ArithmeticError: If it is not at rest although it must be.
        """
        if self.rest and shape.verdict != "open" and not shape.metrics["at_rest"][0]:
            raise ArithmeticError(f"not at rest after {shape.metrics['steps'][0]:.0f} steps")
        metrics = {name: Measured(value, unit) for name, (value, unit) in shape.metrics.items()}
        return metrics | _energy(shape.history["energy"])


class DropTrial(MoltenScene):
    """Drop on a wall or pad, or free."""

    drop: Drop


class RestTrial(DropTrial):
    """Drop at rest, followed for some steps."""

    steps: int = Field(gt=0)


class JointTrial(MoltenScene):
    """Joint between two pads with its expected verdict."""

    joint: Joint
    verdict: Literal["ok", "overflow", "open", "dewetted"] | None = None


class PairTrial(MoltenScene):
    """Two drops with their expected verdict."""

    drops: Drops


class SwingTrial(Parameters):
    """Free oscillating drop."""

    oscillation: Oscillation
    solder: Liquid = Liquid()


def drop(parameters: DropTrial) -> dict[str, Measured]:
    """Bring a drop to rest."""
    from reflowshock.particles.parameters.scene_checks import drop_problems
    from reflowshock.particles.scenes.drop_at_rest import drop_to_rest

    solder = parameters.molten(parameters.drop)
    _refuse(drop_problems(parameters.drop, solder))
    return parameters.measured(drop_to_rest(parameters.drop, solder).shape)


def rest(parameters: RestTrial) -> dict[str, Measured]:
    """Bring a drop to rest and continue for ``steps`` steps; any motion is creep.

    The speed is the largest normal vertex speed in the second half over gamma / mu; the centre moves along the wall
    over V^(1/3); changes of height, width and energy are relative to the values at rest.
    """
    from reflowshock.particles.parameters.scene_checks import drop_problems
    from reflowshock.particles.scenes.drop_at_rest import flow_to_rest
    from reflowshock.particles.scenes.metrics import body_metrics, particles_lost

    solder = parameters.molten(parameters.drop)
    _refuse(drop_problems(parameters.drop, solder))
    flow, run = flow_to_rest(parameters.drop, solder)
    if not run.at_rest:
        raise ArithmeticError(f"not at rest after {flow.steps} steps")
    before, start_centre, energy = flow.profile(), _centre(flow), run.records[-1].energy
    records = [flow.step() for _ in range(parameters.steps)]
    after, late = flow.profile(), records[len(records) // 2 :]
    imbalance = body_metrics(solder, None, flow, run)["energy_imbalance"]
    measures = {
        "volume_drift": flow.body.cloud.parts * flow.body.volume()[0] / solder.volume - 1.0,
        "height_drift": after.drop_height(1) / before.drop_height(1) - 1.0,
        "width_drift": after.max_width / before.max_width - 1.0,
        "place_drift": float(np.linalg.norm(_centre(flow) - start_centre)) / solder.volume ** (1.0 / 3.0),
        "energy_drift": records[-1].energy / energy - 1.0,
        "energy_imbalance": imbalance[0],
        "late_capillary_number": max(record.speed for record in late) * solder.viscosity / solder.surface_tension,
        "particles_lost": particles_lost(flow.body),
    }
    return {name: Measured(float(value)) for name, value in measures.items()}


def _centre(flow: "LiquidFlow") -> np.ndarray:
    """Return the centre of volume of a drop along its wall [m], shape (2,)."""
    from reflowshock.particles.core.surface_measure import centre_of_volume

    body = flow.body
    return centre_of_volume(body.points, body.triangles)[:2]


def joint(parameters: JointTrial) -> dict[str, Measured]:
    """Bring a joint to rest, along its path if it has one."""
    from reflowshock.particles.parameters.joint_checks import joint_problems
    from reflowshock.particles.scenes.joint_at_rest import joint_to_rest

    solder = parameters.molten(parameters.joint)
    _refuse(joint_problems(parameters.joint, solder))
    shape = joint_to_rest(parameters.joint, solder).shape
    if parameters.verdict not in (None, shape.verdict):
        raise ArithmeticError(f'the joint ended "{shape.verdict}", must end "{parameters.verdict}"')
    return parameters.measured(shape)


def pair(parameters: PairTrial) -> dict[str, Measured]:
    """Let two drops or their merged drop come to rest; positions are over V^(1/3)."""
    from reflowshock.particles.core.surface_measure import centre_of_volume
    from reflowshock.particles.parameters.scene_checks import pair_problems
    from reflowshock.particles.scenes.drop_pair import pair_to_rest

    solder = parameters.molten(parameters.drops)
    _refuse(pair_problems(parameters.drops, solder))
    shape = pair_to_rest(parameters.drops, solder).shape
    expected_verdict = "merged" if parameters.drops.merge else "apart"
    if shape.verdict != expected_verdict:
        raise ArithmeticError(f"the drops are {shape.verdict}, must be {expected_verdict}")
    aside = np.linalg.norm(centre_of_volume(shape.surface_points, shape.triangles)[:2])
    return parameters.measured(shape) | {"place_error": Measured(float(aside) / solder.volume ** (1.0 / 3.0))}


def swing(parameters: SwingTrial) -> dict[str, Measured]:
    """Let a free drop oscillate; its momentum is over mass times the largest speed."""
    from reflowshock.particles.parameters.scene_checks import oscillation_problems
    from reflowshock.particles.scenes.free_drop import solve_free_drop

    scene = parameters.oscillation
    solder = scene.resolve(parameters.solder)
    _refuse(oscillation_problems(scene, solder))
    solution = solve_free_drop(solder, scene.amplitude, scene.periods, scene.steps_per_period)
    energy, mass = solution.history["energy"], solder.density * solder.volume
    fastest = np.sqrt(2.0 * solution.history["kinetic_energy"].max() / mass)
    measures = {
        "swings_error": Measured(_swings(solution.history["amplitude"]) / scene.periods - 1.0),
        "momentum": Measured(float(solution.history["momentum"].max() / (mass * fastest))),
        **_energy(energy),
    }
    return {
        name: Measured(*solution.metrics[name]) for name in MEASURES_OF_SWING if name in solution.metrics
    } | measures


def _swings(amplitude: np.ndarray) -> float:
    """Return the number of oscillations by sign changes, since a fit with a second harmonic misses an octave."""
    return 0.5 * float(np.count_nonzero(np.diff(np.sign(amplitude[1:]))) + 1)


def _refuse(problems: list) -> None:
    if problems:
        raise Refused("; ".join(str(problem) for problem in problems))


def _energy(energy: np.ndarray) -> dict[str, Measured]:
    """Return the largest energy rise in a step and above the start, over the energy at the start."""
    scale = abs(float(energy[0]))
    rise = float(np.diff(energy).max(initial=0.0))
    over = float(energy.max() - energy[0])
    return {"energy_rise": Measured(rise / scale), "energy_over_start": Measured(over / scale)}


MEASURES_OF_SWING = {
    "volume_drift": "",
    "period_error": "",
    "decay_rate_error": "",
    "swings_error": "",
    "momentum": "",
    "energy_rise": "",
    "energy_over_start": "",
}
MEASURES_OF_REST = (
    "volume_drift",
    "height_drift",
    "width_drift",
    "place_drift",
    "energy_drift",
    "energy_imbalance",
    "late_capillary_number",
    "particles_lost",
)
TRIALS = {
    "drop": Trial(DropTrial, drop, SHAPE | ERRORS_OF_DROP),
    "rest": Trial(RestTrial, rest, dict.fromkeys(MEASURES_OF_REST, "")),
    "joint": Trial(JointTrial, joint, SHAPE | ERRORS_OF_JOINT),
    "drops": Trial(PairTrial, pair, SHAPE | ERRORS_OF_DROP | ERRORS_OF_PAIR),
    "swing": Trial(SwingTrial, swing, MEASURES_OF_SWING),
}
