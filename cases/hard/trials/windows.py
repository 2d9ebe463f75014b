"""Trials of two coupled models: window growth, long runs, interface transfer, restarts, reflected pulses."""

from dataclasses import replace

import numpy as np
from mpi4py import MPI

from reflowshock.cases.hard.trials.coupled import Coupled, Models, models_of, surveyed
from reflowshock.cases.hard.trials.coupling import PairRun, PairTransfer, PairTrial, Reflection, Yielding
from reflowshock.cases.hard.trials.grids import grid, mesh_of, on
from reflowshock.cases.hard.trials.pairs import FRACTION, SCHEMES, SIZE, Pair
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.coupling.self_check import self_check
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.fem.parallel.checkpoint_state import values
from reflowshock.fem.parallel.exchange import InterfaceChannels
from reflowshock.fem.problem.shock import Coupling
from reflowshock.materials.elasticity import elasticity_matrix
from reflowshock.materials.library import FR4, SAC405
from reflowshock.materials.parameters import Isotropic
from reflowshock.materials.roles import Materials

PUSH = np.array([0.3, 0.1, 1.0])  # [m/s]
SAMPLES = 200  # samples of a run
HALF = 20  # windows before a restart, and after


def window(parameters: PairTrial) -> dict[str, float]:
    """Return the growth of a window, the spectral radius of its amplification matrix minus 1, and m."""
    coupled = coupled_pair(parameters)
    return {"growth": coupled.spectral_radius() - 1.0, "substeps": float(coupled.plan.substeps)}


def run(parameters: PairRun) -> dict[str, float]:
    """Return the largest changes of energy and momentum over many windows after a push, and the interface energy."""
    coupled = coupled_pair(parameters, parameters.free)
    coupled.swing(PUSH)
    start, first = coupled.momentum(), all_energy(coupled)
    changes: list[tuple[float, float]] = []

    def look() -> None:
        changes.append((abs(all_energy(coupled) - first) / first, momentum_change(coupled, start)))

    drift, interface = coupled.drift(parameters.windows, SAMPLES, look)
    energy, momentum = np.max(changes, axis=0)
    return {
        "energy_drift": drift,
        "interface_energy": interface,
        "energy_error": float(energy),
        "momentum_error": float(momentum) if parameters.free else 0.0,
    }


def all_energy(coupled: Coupled) -> float:
    """Return the energy of both models and of the interface."""
    energies = coupled.energies()
    return sum(energies[name] for name in ("kinetic", "internal", "interface"))


def momentum_change(coupled: Coupled, start: np.ndarray) -> float:
    """Return the largest momentum change over the total nodal momentum at the push speed."""
    mass = sum(part.motion.counted_mass.sum() for part in coupled.parts)
    scale = mass * np.linalg.norm(PUSH) * np.array([1.0] * 3 + [3 * SIZE] * 3)
    return float(np.abs((coupled.momentum() - start) / scale).max())


def momentum_error(coupling: Coupling, fraction: float) -> float:
    """Return the largest momentum change of an oscillating free pair."""
    coupled = Pair(4, 3.0, 2, free=True).coupled(coupling, fraction)
    coupled.swing(PUSH)
    start, largest = coupled.momentum(), 0.0
    for _ in range(round(180 / fraction)):
        coupled.run()
        largest = np.maximum(largest, momentum_change(coupled, start))
    return float(largest)


def transfer(parameters: PairTransfer) -> dict[str, float]:
    """Return the errors of tie and interface for rigid motions, linear fields, forces and masses; zero in theory."""
    pair = pair_of(parameters)
    mesh = pair.mesh()
    block = mesh.cells[~mesh.in_parts("board".__eq__)]
    mesh.points[np.unique(block)] += parameters.offset
    return through(models_of(mesh, pair.materials(), SCHEMES[parameters.scheme], parameters.step_fraction))


def through(models: Models) -> dict[str, float]:
    """Return the transfer errors of fields, forces and masses through tie and interface."""
    bodies = models.bodies()
    channels = InterfaceChannels.open(
        MPI.COMM_SELF, bodies["macro"].interface, bodies["meso"].interface, receiver_waits=False
    )
    errors = self_check(MPI.COMM_SELF, bodies, channels)
    masses = errors.macro_mass + errors.interface_mass + errors.meso_mass
    return {
        "rigid_error": errors.rigid,
        "linear_error": errors.linear,
        "tie_error": errors.tie,
        "interface_error": errors.interface,
        "mass_error": masses / errors.volume_mass - 1.0,
    }


def restart(parameters: PairTrial) -> dict[str, float]:
    """Return the difference between a run and its continuation from the middle; zero to the bit."""
    first, second = coupled_pair(parameters), coupled_pair(parameters)
    first.swing(PUSH)
    for _ in range(HALF):
        first.run()
    for ours, others in zip(second.parts, first.parts, strict=True):
        ours.restore(values(others.state()))
    for _ in range(HALF):
        first.run()
        second.run()
    both = [np.concatenate([part.motion.displacement for part in coupled.parts]) for coupled in (first, second)]
    return {"difference": float(np.abs(both[1] - both[0]).max() / np.abs(both[0]).max())}


def yielding(parameters: Yielding) -> dict[str, float]:
    """Return the energy error around yielding solder, and the shares of plastic and interface energy."""
    pair = Pair(ratio=parameters.mesh_ratio)
    models = models_of(pair.mesh(), Materials(solder=SAC405), SCHEMES[parameters.scheme], FRACTION)
    coupled = Coupled(models.bodies(), models.division.plan, scheme_of(parameters.scheme))
    for part in coupled.parts:
        part.motion.launch(np.array([0.0, 0.0, parameters.speed]))
    first = coupled.energies()["kinetic"]
    for _ in range(parameters.windows):
        coupled.run()
    last = coupled.energies()
    held = sum(last[name] for name in ("kinetic", "internal", "plastic", "hourglass", "interface"))
    return {
        "energy_error": held / first - 1.0,
        "plastic_share": last["plastic"] / first,
        "interface_energy": last["interface"] / first,
    }


def coupled_pair(parameters: PairTrial, free: bool = False) -> Coupled:
    """Return both models of a trial, coupled."""
    pair = pair_of(parameters, free)
    if parameters.scheme == "as_printed":
        return pair.printed(parameters.step_fraction)
    return pair.coupled(SCHEMES[parameters.scheme], parameters.step_fraction)


def pair_of(parameters: PairTrial, free: bool = False) -> Pair:
    """Return the pair of a trial."""
    board = FR4
    if parameters.orthotropy:
        board = board.model_copy(
            update={"young_modulus_out_of_plane": FR4.young_modulus_in_plane / parameters.orthotropy}
        )
    names = ("substeps", "impedance", "shape", "layers", "columns", "height", "thinnest")
    same = {name: getattr(parameters, name) for name in names}
    return replace(Pair(**same), ratio=parameters.mesh_ratio, free=free, board=board)


LENGTH = 0.25e-3  # length of a board element along the bar [m]
WIDTH = 0.5e-3  # width of the bar [m]
ROOM = 1.2  # length of the board bar over the pulse
HEIGHT = 1e-6  # height of the pulse [m]; without influence on the measures
STIFFNESS = float(elasticity_matrix(FR4)[2, 2])  # modulus of plane waves along z [Pa]
IMPEDANCE, SPEED = (FR4.density * STIFFNESS) ** 0.5, (STIFFNESS / FR4.density) ** 0.5


def reflection(parameters: Reflection) -> dict[str, float]:
    """Return the errors of the reflected pulse and of the energy, relative to the incident ones.

    Plane waves in a laterally held bar: a displacement f(z - c t) is reflected as (Z1 - Z2) / (Z1 + Z2) f.
    """
    materials = materials_of(parameters)
    models = models_of(mesh_of_bars(parameters), materials, SCHEMES[parameters.scheme], FRACTION)
    coupled = Coupled(models.bodies(), models.division.plan, scheme_of(models.division.scheme))
    begin(coupled, parameters)
    energy = coupled.energies()
    windows = round(ROOM * parameters.elements * LENGTH / SPEED / coupled.plan.window)
    for _ in range(windows):
        coupled.run()
    macro = coupled.macro.motion
    heights = macro.body.local.points[:, 2]
    back = pulse_at(-heights - SPEED * macro.time, parameters)
    solder = materials.solder
    block_impedance = (solder.density * float(elasticity_matrix(solder)[2, 2])) ** 0.5
    ratio = (IMPEDANCE - block_impedance) / (IMPEDANCE + block_impedance)
    last = coupled.energies()
    total = [sum(energies[name] for name in ("kinetic", "internal", "interface")) for energies in (energy, last)]
    return {
        "reflection_error": float(np.abs(macro.displacement[:, 2] - ratio * back).max()) / HEIGHT,
        "reflected": ratio,
        "energy_error": total[1] / total[0] - 1.0,
        "interface_energy": last["interface"] / total[0],
        "substeps": float(coupled.plan.substeps),
    }


def pulse_at(ahead: np.ndarray, parameters: Reflection) -> np.ndarray:
    """Return the displacement [m] of a pulse at a distance [m] ahead of its initial centre."""
    long = parameters.elements * LENGTH
    phase = (ahead + 0.5 * ROOM * long) / long
    return np.where(np.abs(phase) < 0.5, HEIGHT * np.cos(np.pi * phase) ** 4, 0.0)


def begin(coupled: Coupled, parameters: Reflection) -> None:
    """Start the pulse towards the block, centred half the bar below the interface."""
    for part in coupled.parts:
        motion = part.motion
        heights = motion.body.local.points[:, 2]
        moves = motion.mobility[:, 2] > 0.0
        before = pulse_at(heights + SPEED * motion.step, parameters)
        motion.displacement[moves, 2] = pulse_at(heights, parameters)[moves]
        motion.velocity[moves, 2] = (pulse_at(heights, parameters) - before)[moves] / motion.step
    coupled.complete()


def mesh_of_bars(parameters: Reflection) -> MeshData:
    """Return both laterally held bars; the block's bar is long enough for its waves."""
    layers = round(ROOM * parameters.elements) + parameters.elements
    cell = LENGTH / parameters.mesh_ratio
    beyond = round(ROOM * parameters.elements * parameters.substeps * 1.1) + 4
    heights = (np.arange(-layers, 1) * LENGTH, np.arange(beyond + 1) * cell)
    bars = []
    for z, count, part in zip(heights, (1, parameters.mesh_ratio), ("board", "solder@A1"), strict=True):
        flat = np.linspace(0.0, WIDTH, count + 1)
        ends = {"board_side": on(2, 0.0)} if part == "board" else {"foot@A1": on(2, 0.0), "pad_board@A1": on(2, 0.0)}
        ends |= {} if part == "board" else {"pad_package@A1": on(2, z[-1])}
        sides = {f"symmetry_{'xy'[axis]}": either(axis) for axis in (0, 1)}
        bars.append(mesh_of(*grid(flat, flat, z), part, sides | ends))
    return append(bars)


def either(axis: int):
    """Return the test of facets on both sides of the bar."""
    return lambda centres: (np.abs(centres[:, axis]) < 1e-9) | (np.abs(centres[:, axis] - WIDTH) < 1e-9)


def materials_of(parameters: Reflection) -> Materials:
    """Return materials with the block's impedance and a critical step slightly above 1/m of the board's."""
    trial = Materials(solder=Isotropic(density=1e3, young_modulus=1e9, poisson_ratio=0.0))
    _, survey_of_mesh, _ = surveyed(mesh_of_bars(parameters), trial)
    board, block = (survey_of_mesh.step[survey_of_mesh.role == role].min() for role in ("board", "solder"))
    slowness = 1e-3 * board / block / (parameters.substeps - 0.02)
    product = parameters.impedance * IMPEDANCE
    return Materials(solder=Isotropic(density=product * slowness, young_modulus=product / slowness, poisson_ratio=0.0))
