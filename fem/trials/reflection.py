"""Trial of a pulse that runs along a bar of board into a finer bar: what comes back, against what is exact."""

import numpy as np

from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.materials.elasticity import elasticity_matrix
from reflowshock.fem.materials.library import FR4
from reflowshock.fem.materials.parameters import Isotropic
from reflowshock.fem.materials.roles import Materials
from reflowshock.fem.mesh.mesh import MeshData, append
from reflowshock.fem.trials.coupled import Coupled, models_of
from reflowshock.fem.trials.divided import surveyed
from reflowshock.fem.trials.grids import grid, mesh_of, on
from reflowshock.fem.trials.pairs import FRACTION, SCHEMES
from reflowshock.fem.trials.parameters import Reflection

LENGTH = 0.25e-3  # of an element of the board along the bar [m]
WIDTH = 0.5e-3  # of the bar [m]
ROOM = 1.2  # of the bar of board, over the pulse
HEIGHT = 1e-6  # of the pulse [m]; nothing depends on it
STIFFNESS = float(elasticity_matrix(FR4)[2, 2])  # of plane waves along z [Pa]
IMPEDANCE, SPEED = (FR4.density * STIFFNESS) ** 0.5, (STIFFNESS / FR4.density) ** 0.5


def reflection(given: Reflection) -> dict[str, float]:
    """Return the error of the reflected pulse, and of the energy, over the incident ones.

    Plane waves in a bar whose sides are held: of a displacement f(z - c t), (Z1 - Z2) / (Z1 + Z2) f comes back.
    """
    materials = materials_of(given)
    models = models_of(mesh_of_bars(given), materials, SCHEMES[given.scheme], FRACTION)
    coupled = Coupled(models.bodies(), models.division.plan, scheme_of(models.division.scheme))
    begin(coupled, given)
    energy = coupled.energies()
    windows = round(ROOM * given.elements * LENGTH / SPEED / coupled.plan.window)
    for _ in range(windows):
        coupled.run()
    macro = coupled.macro.motion
    place = macro.body.local.points[:, 2]
    back = pulse_at(-place - SPEED * macro.time, given)
    solder = materials.solder
    own = (solder.density * float(elasticity_matrix(solder)[2, 2])) ** 0.5
    ratio = (IMPEDANCE - own) / (IMPEDANCE + own)
    last = coupled.energies()
    total = [sum(found[name] for name in ("kinetic", "internal", "interface")) for found in (energy, last)]
    return {
        "reflection_error": float(np.abs(macro.displacement[:, 2] - ratio * back).max()) / HEIGHT,
        "reflected": ratio,
        "energy_error": total[1] / total[0] - 1.0,
        "interface_energy": last["interface"] / total[0],
        "substeps": float(coupled.plan.substeps),
    }


def pulse_at(ahead: np.ndarray, given: Reflection) -> np.ndarray:
    """Return the displacement [m] of a pulse some way [m] ahead of where its middle began."""
    long = given.elements * LENGTH
    phase = (ahead + 0.5 * ROOM * long) / long
    return np.where(np.abs(phase) < 0.5, HEIGHT * np.cos(np.pi * phase) ** 4, 0.0)


def begin(coupled: Coupled, given: Reflection) -> None:
    """Let the pulse run towards the block, its middle half the bar below the interface."""
    for part in coupled.parts:
        motion = part.motion
        place = motion.body.local.points[:, 2]
        moves = motion.mobility[:, 2] > 0.0
        before = pulse_at(place + SPEED * motion.step, given)
        motion.displacement[moves, 2] = pulse_at(place, given)[moves]
        motion.velocity[moves, 2] = (pulse_at(place, given) - before)[moves] / motion.step
    coupled.complete()


def mesh_of_bars(given: Reflection) -> MeshData:
    """Return both bars, whose sides keep their planes; the block's is as long as its waves come."""
    layers = round(ROOM * given.elements) + given.elements
    cell = LENGTH / given.mesh_ratio
    beyond = round(ROOM * given.elements * given.substeps * 1.1) + 4
    heights = (np.arange(-layers, 1) * LENGTH, np.arange(beyond + 1) * cell)
    bars = []
    for z, count, part in zip(heights, (1, given.mesh_ratio), ("board", "solder@A1"), strict=True):
        flat = np.linspace(0.0, WIDTH, count + 1)
        ends = {"board_side": on(2, 0.0)} if part == "board" else {"foot@A1": on(2, 0.0), "pad_board@A1": on(2, 0.0)}
        ends |= {} if part == "board" else {"pad_package@A1": on(2, z[-1])}
        sides = {f"symmetry_{'xy'[axis]}": either(axis) for axis in (0, 1)}
        bars.append(mesh_of(*grid(flat, flat, z), part, sides | ends))
    return append(bars)


def either(axis: int):
    """Return the test of facets on both sides of the bar."""
    return lambda centres: (np.abs(centres[:, axis]) < 1e-9) | (np.abs(centres[:, axis] - WIDTH) < 1e-9)


def materials_of(given: Reflection) -> Materials:
    """Return materials with the impedance of the block whose critical step is a little above 1/m of the board's."""
    trial = Materials(solder=Isotropic(density=1e3, young_modulus=1e9, poisson_ratio=0.0))
    _, found, _ = surveyed(mesh_of_bars(given), trial)
    board, block = (found.step[found.role == role].min() for role in ("board", "solder"))
    slowness = 1e-3 * board / block / (given.substeps - 0.02)
    product = given.impedance * IMPEDANCE
    return Materials(solder=Isotropic(density=product * slowness, young_modulus=product / slowness, poisson_ratio=0.0))
