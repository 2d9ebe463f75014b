"""Scenes with one effect on or off, and what a piece of work calls: for the tests of the registry of effects."""

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
from reflowshock.fem.materials.library import FR4
from reflowshock.fem.materials.parameters import Material
from reflowshock.fem.model.assembly import ForceOptions
from reflowshock.fem.model.body import Body
from reflowshock.fem.problem.shock import Shock
from reflowshock.particles.core.cloud import box_cloud
from reflowshock.particles.parameters.solder import Solder
from reflowshock.particles.physics.physics import Physics
from reflowshock.particles.scenes.reflow import contact_line, start_flow
from reflowshock.particles.steps.flow import LiquidFlow

__all__ = ["DOWN", "BodyAcceleration", "HalfSine", "motion_of"]
G = 9.80665
SOLDER = Solder(volume=1e-9, pad_contact_angle=np.radians(120.0))
LENGTH, THICKNESS = 40e-3, 1e-3
RESTING = {"gravity": True, "surface_tension": True, "wall_adhesion": True, "inertia": False, "viscosity": False}


def calls(work: Callable[[], object]) -> Counter:
    """Return how often each Python function is called, and how often compiled ones are, by a piece of work."""
    found: Counter = Counter()

    def count(frame, event: str, argument) -> None:
        if event == "call":
            found[(frame.f_globals.get("__name__", ""), frame.f_code.co_qualname)] += 1
        elif event == "c_call":
            found[("", getattr(argument, "__qualname__", ""))] += 1

    sys.setprofile(count)
    try:
        work()
    finally:
        sys.setprofile(None)
    return found


def enters(found: Counter, place: str) -> bool:
    """Whether any method of a class, or a function, was called, given by its dotted name."""
    module, _, name = place.rpartition(".")
    return any(at == module and (qualified == name or qualified.startswith(f"{name}.")) for at, qualified in found)


def flow_with(acting: Mapping[str, bool], count: int = 5, solder: Solder = SOLDER) -> LiquidFlow:
    """Return a cube of solder on a wall, at its start."""
    cloud = box_cloud(solder.volume ** (1.0 / 3.0), count)
    return start_flow(cloud, solder, dict(acting), (contact_line(cloud, 0, np.inf, solder),))


def without(physics: Physics, kind: type) -> Physics:
    """Return the lists of what acts without the objects of one kind."""
    lists = {item.name: getattr(physics, item.name) for item in fields(physics)}
    return replace(physics, **{name: tuple(x for x in old if not isinstance(x, kind)) for name, old in lists.items()})


def shock(**changes) -> Shock:
    return Shock(**({"peak_acceleration": 1500 * G, "pulse_duration": 5e-4, "duration": 1e-3} | changes))


def strip(kinematics: str = "small", material: Material = FR4) -> tuple[Body, float]:
    """Return a strip of board between two held ends, and half its critical step [s]."""
    lines = np.linspace(0.0, LENGTH, 21), [0.0, 2e-3], np.linspace(0.0, THICKNESS, 3)
    ends = {"mounting_holes": lambda c: on(0, 0.0)(c) | on(0, LENGTH)(c)}
    mesh = mesh_of(*grid(*lines), "board", ends)
    if kinematics == "small" and material is FR4:
        body, critical = dns_body(mesh)
    else:
        body, critical = nonlinear_body(mesh, material, ForceOptions(kinematics))
    return body, 0.5 * critical


def loads_of(body: Body, wanted: Shock) -> list[Load]:
    """Return the loads of a shock on a body without holes to shake."""
    tables: Any = SimpleNamespace(shaken=np.empty(0, np.int32))
    return shock_loads(MPI.COMM_SELF, float(body.mass.sum()), body, tables, wanted)


def moved(body: Body, step: float, loads: list[Load], duration: float) -> tuple[ExplicitMotion, float]:
    """Return the motion after a duration [s], and the largest deflection of its middle [m] until then."""
    motion, largest = motion_of(body, step, loads), 0.0
    middle = np.argmin(np.abs(body.local.points[:, 0] - 0.5 * LENGTH))
    for _ in range(round(duration / step)):
        step_of(motion)
        largest = max(largest, abs(float(motion.displacement[middle, 2])))
    return motion, largest


def step_of(motion: ExplicitMotion) -> None:
    """Take a step of a motion."""
    motion.advance()
    motion.update_force()
