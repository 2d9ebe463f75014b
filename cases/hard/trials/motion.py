"""Trials of one moving model: free flight near the critical step, rod impact, and short pulses."""

from collections.abc import Callable

import numpy as np
from mpi4py import MPI

from reflowshock.cases.hard.trials.bodies import SOLDER, dns_body, motion_of, nonlinear_body
from reflowshock.cases.hard.trials.boxes import YOUNG, distorted, laminate
from reflowshock.cases.hard.trials.elements import Flight, Impact, PulseTrial
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.fem.division.checks import check_pulses
from reflowshock.fem.division.tables import Tables, prepare
from reflowshock.fem.dynamics.central_difference import ExplicitMotion
from reflowshock.fem.dynamics.energy_balance import EnergyBalance, energy_sums
from reflowshock.fem.dynamics.participant import SingleModel, explicit_motion
from reflowshock.fem.estimates.estimate import WindowPlan, damped_critical_step
from reflowshock.fem.forces.force import Kinematics
from reflowshock.fem.loads.damping import RayleighDamping
from reflowshock.fem.loads.load import BodyAcceleration, Load
from reflowshock.fem.loads.pulse import Constant, HalfSine, Haversine, Pulse, Tabulated
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.tie import net_load
from reflowshock.fem.model.assembly import ForceOptions, RankElements, make_body, make_rank_elements
from reflowshock.fem.model.body import Body
from reflowshock.fem.model.power_iteration import highest_frequency
from reflowshock.fem.model.steps import mass_factor
from reflowshock.fem.parallel.local_mesh import distribute
from reflowshock.materials.library import COPPER
from reflowshock.materials.parameters import Material
from reflowshock.materials.roles import Materials

HEIGHT = 1e-3  # height of a box [m]
SPEED = np.array([1.0, -2.0, 3.0])  # speed of the whole body [m/s]
LOOK = 50  # steps between energy samples; a doubling in each step stays finite
BALANCE = 0.02  # limit of the energy balance, the program's default


def flight(parameters: Flight) -> dict[str, float]:
    """Return the errors of energies and momenta, and the assembled critical step over the element step.

    Energies are checked as in a run; momenta are relative to the sum of all nodal magnitudes.

    Raises:
        EnergyError: If the step exceeds the critical one or energies do not balance.
    """
    rank_elements, tables = rank_elements_of(parameters)
    target = float(rank_elements.steps[rank_elements.roles != "copper"].min())
    factor = mass_factor(rank_elements, ("copper",) if parameters.mass_scaled else (), target)
    element = float((rank_elements.steps * np.sqrt(factor)).min())
    linear = make_body(MPI.COMM_SELF, rank_elements, tables, factor, None)
    assembled = highest_frequency(MPI.COMM_SELF, linear, linear.terms, linear.mass).critical_step
    plain = element if parameters.critical_step == "element" else assembled
    stiffness = parameters.stiffness_damping * plain
    critical = float(damped_critical_step(plain, stiffness))
    step = parameters.step_fraction * critical
    body = make_body(MPI.COMM_SELF, rank_elements, tables, factor, ForceOptions(parameters.kinematics, step))
    loads: list[Load] = []
    if parameters.mass_damping or stiffness:
        loads.append(RayleighDamping.build(body, parameters.mass_damping / step, stiffness))
    motion = explicit_motion(body, loads, step)
    random_start(motion, parameters.seed)
    errors = watched(motion, parameters, EnergyBalance(limit=BALANCE, trivial=0.0, step=step, critical=critical))
    return errors | {"step_gain": assembled / element}


def rank_elements_of(parameters: Flight) -> tuple[RankElements, Tables]:
    """Return the elements of a trial on this rank and their tables."""
    item = prepare(mesh_of_flight(parameters), "dns")["dns"]
    soft = laminate(parameters.poisson_ratio, parameters.orthotropy, YOUNG / parameters.contrast)
    materials = Materials(
        board=laminate(parameters.poisson_ratio, parameters.orthotropy), substrate=soft, copper=COPPER
    )
    formulation = parameters.element if parameters.element == "one_point" else "incompatible_modes"
    local = distribute(MPI.COMM_SELF, item.mesh)
    return make_rank_elements(local, item.tables, materials, formulation), item.tables


def mesh_of_flight(parameters: Flight) -> MeshData:
    """Return the mesh: board, optional copper, and substrate from below."""
    flat = np.linspace(0.0, HEIGHT * parameters.aspect * parameters.cells, parameters.cells + 1)
    low = np.linspace(0.0, HEIGHT * parameters.cells, parameters.cells + 1)
    half = HEIGHT * (parameters.cells // 2)
    lines = (flat, flat, np.unique(np.concatenate([low[low <= half], low[low >= half] + parameters.foil])))
    points, cells = distorted(parameters.element, lines, parameters.quality, parameters.seed)
    of_box = 1 if cells.shape[1] == 8 else 6
    middles = 0.5 * (lines[2][1:] + lines[2][:-1])
    names = np.where(middles < half, "board", np.where(middles < half + parameters.foil, "copper_board", "substrate"))
    return mesh_of(points, cells, np.repeat(names, parameters.cells**2 * of_box), {})


def random_start(motion: ExplicitMotion, seed: int) -> None:
    """Add energy to all modes equally, on top of a common speed."""
    noise = np.random.default_rng(seed).normal(size=motion.velocity.shape) * np.sqrt(motion.mobility)
    mass = motion.body.mass[:, None]
    scale = np.linalg.norm(SPEED) / np.sqrt(np.sum(mass * noise**2) / mass.sum())
    motion.velocity[:] = np.where(motion.mobility > 0.0, SPEED + scale * noise, 0.0)


def watched(motion: ExplicitMotion, parameters: Flight, balance: EnergyBalance) -> dict[str, float]:
    """Take the steps with energy samples and return the errors; raises as ``flight``."""
    steps = min(LOOK, parameters.steps)
    looks = parameters.steps // steps
    participant = SingleModel(motion, WindowPlan(steps * motion.step, steps, looks, 1))
    balance.judge(energy_sums(participant, 0.0), 0.0)
    first, error = momentum(motion, parameters.kinematics == "finite"), np.zeros(2)
    scale = momentum_scale(motion)
    for _ in range(looks):
        participant.begin_window()
        balance.judge(energy_sums(participant, 0.0), motion.time)
        change = np.abs(momentum(motion, parameters.kinematics == "finite") - first).reshape(2, 3).max(axis=1)
        error = np.maximum(error, change / scale)
    return {
        "energy_error": balance.balance_error,
        "momentum_error": float(error[0]),
        "angular_momentum_error": float(error[1]),
        "energy_left": balance.latest["kinetic"] / balance.initial,
    }


def momentum(motion: ExplicitMotion, moved: bool) -> np.ndarray:
    """Return linear and angular momentum (6,), about current positions for finite strains."""
    places = motion.body.local.points + (motion.displacement if moved else 0.0)
    return net_load(places, motion.body.mass[:, None] * motion.present_velocity())


def momentum_scale(motion: ExplicitMotion) -> np.ndarray:
    """Return the sums of nodal magnitudes of linear and angular momentum (2,)."""
    points, amount = motion.body.local.points, motion.body.mass[:, None] * motion.present_velocity()
    return np.array([np.linalg.norm(amount, axis=1).sum(), np.linalg.norm(np.cross(points, amount), axis=1).sum()])


FRACTION = 0.9  # step over the critical step, the program's default
DIRECTION = np.array([0.6, 0.0, 0.8])
AFTER = 5  # steps after the pulse


def pulse(parameters: PulseTrial) -> dict[str, float]:
    """Return the errors of speed and displacement after the pulse, and the strain energy over the input energy.

    Raises:
        PulseError: If the pulse is shorter than a step.
    """
    body, critical = dns_body(block())
    step = FRACTION * critical
    duration = parameters.steps * step
    check_pulses([duration], step, FRACTION)
    course = course_of(parameters, duration)
    motion = motion_of(body, step, [BodyAcceleration(DIRECTION, course)])
    for _ in range(int(np.ceil(parameters.steps)) + AFTER):
        motion.advance()
        motion.update_force()
    speed, way = motion.present_velocity() @ DIRECTION, motion.displacement @ DIRECTION
    exact = np.array([course.integral(motion.time), course.double_integral(motion.time)])
    scale = np.where(exact > 0.0, exact, 1.0)
    errors = [
        np.abs(value_at_end - value).max() for value_at_end, value in zip((speed, way), exact, strict=True)
    ] / scale
    received_energy = max(float(motion.external_work), float(np.finfo(float).tiny))
    return {
        "velocity_error": float(errors[0]),
        "displacement_error": float(errors[1]),
        "strain_energy": motion.internal_energy().total / received_energy,
        "energy_error": motion.kinetic_energy() / received_energy - 1.0 if parameters.peak else 0.0,
    }


def block() -> MeshData:
    """Return a free block of board."""
    line = np.linspace(0.0, 1e-3, 3)
    return mesh_of(*grid(line, line, line), "board", {})


def course_of(parameters: PulseTrial, duration: float) -> Pulse:
    """Return the pulse of a duration [s]."""
    if parameters.pulse == "triangle":
        return Tabulated(np.array([0.0, 0.5, 1.0]) * duration, np.array([0.0, parameters.peak, 0.0]))
    if parameters.pulse == "constant":
        return Constant(parameters.peak, duration)
    return (HalfSine if parameters.pulse == "half_sine" else Haversine)(parameters.peak, duration)


def impact(parameters: Impact) -> dict[str, float]:
    """Return the largest energy imbalance, the plastic work, and whether it ever decreases."""

    def skew(points: np.ndarray) -> np.ndarray:
        return points + np.outer(points[:, 1], [0.0, 0.0, parameters.skew])

    mesh = rod(6e-3, 1e-3, (18, 3), skew)
    body, motion = explicit(mesh, SOLDER, parameters.kinematics, parameters.element, parameters.step_fraction)
    motion.velocity[:, 0] = np.where(body.free[:, 0], -parameters.speed, 0.0)
    energies = energies_of(motion, parameters.steps)
    first = energies[0].sum()
    return {
        "energy_error": imbalance(energies),
        "plastic_share": float(energies[-1, 2] / first),
        "plastic_return": float(np.abs(np.diff(energies[:, 2]).min(initial=0.0)) / first),
        "hourglass_share": float(np.abs(energies[:, 3]).max() / first),
    }


def rod(
    length: float,
    width: float,
    counts: tuple[int, int],
    move: Callable[[np.ndarray], np.ndarray] = lambda points: points,
) -> MeshData:
    """Return a rod along x, held at x = 0 in that direction."""
    across = np.linspace(0, width, counts[1] + 1)
    points, cells = grid(np.linspace(0, length, counts[0] + 1), across, across)
    return mesh_of(move(points), cells, "board", {"symmetry_x": on(0, 0.0), "symmetry_y": on(1, 0.0)})


def explicit(
    mesh: MeshData, material: Material, kinematics: Kinematics, formulation: str, fraction: float
) -> tuple[Body, ExplicitMotion]:
    """Return a body of one material and its motion at a fraction of its critical element step."""
    _, critical = nonlinear_body(mesh, material, ForceOptions(kinematics, np.inf), formulation)
    body, _ = nonlinear_body(mesh, material, ForceOptions(kinematics, fraction * critical), formulation)
    return body, motion_of(body, fraction * critical)


def energies_of(motion: ExplicitMotion, steps: int) -> np.ndarray:
    """Take steps; return kinetic, strain, plastic and hourglass energy of each, shape (steps + 1, 4)."""
    energies = []
    for _ in range(steps + 1):
        held = motion.internal_energy()
        energies.append([motion.kinetic_energy(), held.strain, held.plastic, held.hourglass])
        motion.advance()
        motion.update_force()
    return np.array(energies)


def imbalance(energies: np.ndarray) -> float:
    """Return the largest change of the sum of energies (steps + 1, k) over the first sum."""
    total = energies.sum(axis=1)
    return float(np.abs(total - total[0]).max() / total[0])
