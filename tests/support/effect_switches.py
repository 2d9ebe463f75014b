"""Scenes with one effect on or off, and a call counter, for the tests of the registry of effects."""

import sys
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import dns_body, motion_of, nonlinear_body
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.loads.load import DOWN, BodyAcceleration, Load
from reflowshock.fem.loads.pulse import HalfSine
from reflowshock.fem.loads.shock_loads import shock_loads
from reflowshock.fem.model.assembly import ForceOptions
from reflowshock.fem.model.body import Body
from reflowshock.fem.problem.shock import Shock
from reflowshock.materials.library import FR4
from reflowshock.materials.parameters import Material
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.scenes.flow_setup import contact_line, start_flow
from reflowshock.particles.steps.flow import LiquidFlow

__all__ = ["DOWN", "BodyAcceleration", "HalfSine", "motion_of"]
G = 9.80665
SOLDER = Solder(volume=1e-9, pad_contact_angle=np.radians(120.0))
LENGTH, THICKNESS = 40e-3, 1e-3
RESTING = {"gravity": True, "surface_tension": True, "wall_adhesion": True}
RHEOLOGY = "tests/unit/particles/test_rheology.py"
FREEZING = "tests/unit/particles/test_freezing.py"
FLOWS, DROPLETS = (f"tests/verification/test_particles_{name}.py" for name in ("flows", "droplets"))
# Effects that need a whole run are tested in tests that have one.
ELSEWHERE_OFF = {
    "identical_joints": "tests/pipeline/test_pipeline.py::test_the_whole_path",
    "flow_viscosity": f"{FLOWS}::test_a_term_that_is_off_is_not_computed",
    "artificial_viscosity": f"{FLOWS}::test_a_term_that_is_off_is_not_computed",
    "shear_dependent_viscosity": f"{RHEOLOGY}::test_shear_dependence_acts_where_it_is_given_and_viscosity_acts",
    "droplet_tension": f"{DROPLETS}::test_effects_that_are_off_do_nothing",
    "droplet_gravity": f"{DROPLETS}::test_effects_that_are_off_do_nothing",
    "freezing": f"{FREEZING}::test_light_cures_drops_that_do_not_freeze",
}
ELSEWHERE_ON = {
    "flow_viscosity": f"{FLOWS}::test_neglected_viscosity_changes_nothing",
    "artificial_viscosity": f"{FLOWS}::test_small_artificial_viscosity_changes_little",
    "shear_dependent_viscosity": f"{RHEOLOGY}::test_an_exponent_of_one_computes_what_constant_viscosity_does",
    "droplet_tension": f"{DROPLETS}::test_small_tension_changes_little",
    "droplet_gravity": f"{DROPLETS}::test_small_weight_changes_little",
    "freezing": f"{FREEZING}::test_slow_freezing_changes_little",
    "flexible": "tests/unit/fem/test_thermal_effects.py::test_warpage_stays_below_its_number",
    "solder_force": "tests/unit/fem/test_thermal_effects.py::test_bending_by_the_solder_stays_below_its_number",
    "one_way": "tests/unit/fem/test_one_way_run.py::test_driven_joint_is_stressed_as_a_coupled_one",
    "coarse_joints": "tests/pipeline/test_identical_joints.py::test_the_fine_joint_agrees_with_the_dns",
    "identical_joints": "tests/pipeline/test_identical_joints.py::test_what_the_shapes_change_is_told",
    "large_mass": "tests/mpi/test_fem_shock_methods.py::test_large_mass_at_the_holes_is_direct_acceleration",
    "symmetry": "tests/verification/test_fem_thermal_symmetry.py::test_quarter_model_equals_full_model",
}


def calls(work: Callable[[], object]) -> Counter:
    """Run a piece of work and count the calls of each Python and compiled function in it.

    Returns:
        (module, qualified name) -> number of calls; the module of compiled functions is empty.
    """
    counter: Counter = Counter()

    def count(frame, event: str, argument) -> None:
        if event == "call":
            counter[(frame.f_globals.get("__name__", ""), frame.f_code.co_qualname)] += 1
        elif event == "c_call":
            counter[("", getattr(argument, "__qualname__", ""))] += 1

    sys.setprofile(count)
    try:
        work()
    finally:
        sys.setprofile(None)
    return counter


def enters(counted_calls: Counter, dotted_name: str) -> bool:
    """Return whether a function, or any method of a class, was called.

    Args:
        counted_calls: Counter that ``calls`` returned.
        dotted_name: Module and name of the function or class.
    """
    module, _, name = dotted_name.rpartition(".")
    return any(
        at == module and (qualified == name or qualified.startswith(f"{name}.")) for at, qualified in counted_calls
    )


def flow_with(acting: Mapping[str, bool], count: int = 5, solder: Solder = SOLDER) -> LiquidFlow:
    """Return the flow of a cube of solder on a wall, at time 0.

    Args:
        acting: Effect -> on or off.
        count: Number of particles along an edge.
        solder: Volume, fluid and contact angles.
    """
    cloud = box_cloud(solder.volume ** (1.0 / 3.0), count)
    return start_flow(cloud, solder, dict(acting), (contact_line(cloud, 0, np.inf, solder),))


def without(physics: Physics, kind: type) -> Physics:
    """Return a copy of the physics whose lists of forces, operators and other objects lack those of one class."""
    lists = {item.name: old for item in fields(physics) if isinstance(old := getattr(physics, item.name), tuple)}
    return replace(physics, **{name: tuple(x for x in old if not isinstance(x, kind)) for name, old in lists.items()})


def shock(**changes) -> Shock:
    """Return the parameters of a shock of 1500 G for 0.5 ms, run for 1 ms; ``changes`` replace or add fields."""
    return Shock(**({"peak_acceleration": 1500 * G, "pulse_duration": 5e-4, "duration": 1e-3} | changes))


def strip(kinematics: str = "small", material: Material = FR4) -> tuple[Body, float]:
    """Return a strip of board with both ends held, and half its critical time step [s].

    Args:
        kinematics: "small", "corotational" or "finite".
        material: Material of all elements.
    """
    lines = np.linspace(0.0, LENGTH, 21), [0.0, 2e-3], np.linspace(0.0, THICKNESS, 3)
    ends = {"mounting_holes": lambda c: on(0, 0.0)(c) | on(0, LENGTH)(c)}
    mesh = mesh_of(*grid(*lines), "board", ends)
    if kinematics == "small" and material is FR4:
        body, critical = dns_body(mesh)
    else:
        body, critical = nonlinear_body(mesh, material, ForceOptions(kinematics))
    return body, 0.5 * critical


def loads_of(body: Body, settings: Shock) -> list[Load]:
    """Return the loads of a shock on a body that has no mounting holes to shake."""
    tables: Any = SimpleNamespace(shaken=np.empty(0, np.int32))
    return shock_loads(MPI.COMM_SELF, float(body.mass.sum()), body, tables, settings)


def moved(body: Body, step: float, loads: list[Load], duration: float) -> tuple[ExplicitMotion, float]:
    """Move a body in explicit steps from rest.

    Args:
        body: Strip of ``strip``.
        step: Time step [s].
        loads: Loads that act on it.
        duration: Simulated time [s].

    Returns:
        Motion at the end, and the largest deflection of the middle until then [m].
    """
    motion, largest = motion_of(body, step, loads), 0.0
    middle = np.argmin(np.abs(body.local.points[:, 0] - 0.5 * LENGTH))
    for _ in range(round(duration / step)):
        step_of(motion)
        largest = max(largest, abs(float(motion.displacement[middle, 2])))
    return motion, largest


def step_of(motion: ExplicitMotion) -> None:
    """Take one step of a motion, in place, force included."""
    motion.advance()
    motion.update_force()
