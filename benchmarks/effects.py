"""Cost of each effect: time of a step with the effect over the time without it, measured in turns.

The results feed the cost shares of plans. Writes benchmarks/results/effects.json and workflow/effects/costs.json.
"""

import json
from collections.abc import Callable, Mapping

import numpy as np

from benchmarks.support import results, turns
from reflowshock.cases.hard.trials.bodies import dns_body, motion_of
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.forces.force import Kinematics, force_terms
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.loads.load import DOWN, BodyAcceleration, Load
from reflowshock.fem.loads.pulse import STANDARD_GRAVITY, Constant, HalfSine
from reflowshock.materials.library import FR4, SAC305
from reflowshock.materials.parameters import Material
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.parameters.effects import LIQUID_EFFECTS
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.scenes.flow_setup import contact_line, start_flow
from reflowshock.workflow.effects.table import MEASURED

CELLS, PER_EDGE, STRETCH = (40, 20, 4), 11, 2.0e-3
PULSE = BodyAcceleration(DOWN, HalfSine(1.5e4, 5e-4))
WEIGHT = BodyAcceleration(DOWN, Constant(STANDARD_GRAVITY))
DROP = Solder(volume=1e-9, pad_contact_angle=np.radians(120.0))
RESTING = {"gravity": True, "surface_tension": True, "wall_adhesion": True}
RATELESS = SAC305.model_copy(update={"plasticity": SAC305.plasticity.model_copy(update={"C": 0.0})})
BOARD = dns_body(
    mesh_of(
        *grid(*(np.linspace(0.0, size, cells + 1) for size, cells in zip((40e-3, 20e-3, 1e-3), CELLS, strict=True))),
        "board",
        {"mounting_holes": on(0, 0.0)},
    )
)

LIQUID = [effect.name for effect in LIQUID_EFFECTS if effect.is_measured]
# Effect -> description of the measurement, side with the effect, side without it.
PAIRS = {
    name: (f"a step of {PER_EDGE**3} particles", f"reflow_{name}", f"reflow_without_{name}") for name in LIQUID
} | {
    "gravity_in_the_shock": ("an explicit step of 3200 boxes", "drop_weight", "drop"),
    "damping": ("the same, alpha alone; with beta see damping_stiffness", "drop_alpha", "drop"),
    "damping_stiffness": ("the same", "drop_beta", "drop"),
    "finite_rotation": ("the force of 3200 boxes, incompatible modes", "force_finite", "force"),
    "plasticity": ("the same, below yield", "force_yielding", "force"),
    "strain_rate": ("the force of 3200 boxes that flow", "flowing", "flowing_rateless"),
}


def reflow_step(**changes: bool) -> Callable[[], object]:
    """Return a function that takes one step of a cube of solder that keeps flowing on a wall.

    Args:
        changes: Effect -> on or off, for effects other than those of a flow at rest.
    """
    cloud = box_cloud(DROP.volume ** (1.0 / 3.0), PER_EDGE)
    return start_flow(cloud, DROP, RESTING | changes, (contact_line(cloud, 0, np.inf, DROP),)).step


def drop_step(*loads: Load) -> Callable[[], object]:
    """Return a function that takes one explicit step of a board under loads.

    Args:
        loads: Loads that act on the board.
    """
    body, critical = BOARD
    motion = motion_of(body, 0.5 * critical, loads)

    def step() -> None:
        motion.advance()
        motion.update_force()

    return step


def force_step(material: Material, kinematics: Kinematics = "small", stretch: float = 0.0) -> Callable[[], object]:
    """Return a function that evaluates the internal force of a board's elements at a strain that grows with each call.

    Args:
        material: Material of all elements.
        kinematics: "small" or "finite" strain.
        stretch: Increment of the strain per call.
    """
    body, _ = BOARD
    terms = force_terms(body.elements, [material], kinematics, 1e-8)
    points, result = body.local.points, np.zeros_like(body.local.points)
    pattern = points[:, :1] * [1.0, 0.0, 0.0]
    strain = 0.0

    def work() -> None:
        nonlocal strain
        strain += stretch
        for term in terms:
            term.add(strain * pattern, result)

    return work


def make_sides() -> dict[str, Callable[[], object]]:
    """Return the name of each side of the comparisons -> function that takes one step or evaluates one force."""
    body = BOARD[0]
    reflows = {PAIRS[name][2 - acts]: reflow_step(**{name: acts}) for name in LIQUID for acts in (True, False)}
    return reflows | {
        "drop": drop_step(PULSE),
        "drop_weight": drop_step(PULSE, WEIGHT),
        "drop_alpha": drop_step(PULSE, RayleighDamping.build(body, 1.0, 0.0)),
        "drop_beta": drop_step(PULSE, RayleighDamping.build(body, 0.0, 1e-10)),
        "force": force_step(FR4),
        "force_finite": force_step(FR4, "finite"),
        "force_yielding": force_step(SAC305),
        "flowing": force_step(SAC305, stretch=STRETCH),
        "flowing_rateless": force_step(RATELESS, stretch=STRETCH),
    }


def compute_ratios(seconds: Mapping[str, np.ndarray]) -> dict[str, dict]:
    """Return the cost of each effect.

    Args:
        seconds: Name of a side -> processor seconds of a call in each round, shape (rounds,).

    Returns:
        Effect -> ``ratio``, the median over the rounds of the seconds with the effect over those without, and ``of``,
        the work that was measured.
    """
    return {
        name: {"ratio": float(np.median(seconds[acting] / seconds[left_out])), "of": what}
        for name, (what, acting, left_out) in PAIRS.items()
    }


def main() -> None:
    """Measure all sides in turns; store the costs of the effects, also where the forecast of a run reads them."""
    seconds = turns.measure_in_turns({name: turns.make_batch(work) for name, work in make_sides().items()})
    cost_ratios = compute_ratios(seconds)
    MEASURED.write_text(json.dumps({"source": "benchmarks/effects.py", "effects": cost_ratios}, indent=1) + "\n")
    medians = {name: float(np.median(s)) for name, s in seconds.items()}
    results.write_and_print("effects", {"effects": cost_ratios, "seconds": medians})


if __name__ == "__main__":
    main()
