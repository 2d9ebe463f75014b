"""Trials of two coupled models: does a window grow, what is kept over many, what goes through tie and cut, restarts."""

from dataclasses import replace

import numpy as np
from mpi4py import MPI

from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.coupling.self_check import self_check
from reflowshock.fem.materials.library import FR4, SAC405
from reflowshock.fem.materials.roles import Materials
from reflowshock.fem.parallel.exchange import InterfaceChannels
from reflowshock.fem.parallel.portable import values
from reflowshock.fem.problem.shock import Coupling
from reflowshock.fem.trials.coupled import Coupled, Models, models_of
from reflowshock.fem.trials.pairs import FRACTION, SCHEMES, SIZE, Pair
from reflowshock.fem.trials.parameters import PairRun, PairTransfer, PairTrial, Yielding

PUSH = np.array([0.3, 0.1, 1.0])  # [m/s]
SAMPLES = 200  # of a run
HALF = 20  # windows before a restart, and after


def window(given: PairTrial) -> dict[str, float]:
    """Return by how much a window can grow, the spectral radius of its amplification matrix minus 1, and m."""
    coupled = coupled_pair(given)
    return {"growth": coupled.spectral_radius() - 1.0, "substeps": float(coupled.plan.substeps)}


def run(given: PairRun) -> dict[str, float]:
    """Return what changes at most in many windows after a push: energy, momentum, and what the interface holds."""
    coupled = coupled_pair(given, given.free)
    coupled.swing(PUSH)
    start, first = coupled.momentum(), all_energy(coupled)
    changes: list[tuple[float, float]] = []

    def look() -> None:
        changes.append((abs(all_energy(coupled) - first) / first, momentum_change(coupled, start)))

    drift, interface = coupled.drift(given.windows, SAMPLES, look)
    energy, momentum = np.max(changes, axis=0)
    return {
        "energy_drift": drift,
        "interface_energy": interface,
        "energy_error": float(energy),
        "momentum_error": float(momentum) if given.free else 0.0,
    }


def all_energy(coupled: Coupled) -> float:
    """Return the energy of both models and of what lies between."""
    energies = coupled.energies()
    return sum(energies[name] for name in ("kinetic", "internal", "interface"))


def momentum_change(coupled: Coupled, start: np.ndarray) -> float:
    """Return the largest change of linear and angular momentum over that of all nodes at the speed of the push."""
    mass = sum(part.motion.counted_mass.sum() for part in coupled.parts)
    scale = mass * np.linalg.norm(PUSH) * np.array([1.0] * 3 + [3 * SIZE] * 3)
    return float(np.abs((coupled.momentum() - start) / scale).max())


def momentum_error(coupling: Coupling, fraction: float) -> float:
    """Return the largest change of momentum of a free pair while it swings."""
    coupled = Pair(4, 3.0, 2, free=True).coupled(coupling, fraction)
    coupled.swing(PUSH)
    start, largest = coupled.momentum(), 0.0
    for _ in range(round(180 / fraction)):
        coupled.run()
        largest = np.maximum(largest, momentum_change(coupled, start))
    return float(largest)


def transfer(given: PairTransfer) -> dict[str, float]:
    """Return what tie and cut do to rigid motions, linear fields, forces and masses: nothing, exactly."""
    pair = pair_of(given)
    mesh = pair.mesh()
    block = mesh.cells[~mesh.in_parts("board".__eq__)]
    mesh.points[np.unique(block)] += given.offset
    return through(models_of(mesh, pair.materials(), SCHEMES[given.scheme], given.step_fraction))


def through(models: Models) -> dict[str, float]:
    """Try fields, forces and masses through tie and cut of two models."""
    bodies = models.bodies()
    channels = InterfaceChannels.open(
        MPI.COMM_SELF, bodies["macro"].interface, bodies["meso"].interface, receiver_waits=False
    )
    found = self_check(MPI.COMM_SELF, bodies, channels)
    masses = found.macro_mass + found.interface_mass + found.meso_mass
    return {
        "rigid_error": found.rigid,
        "linear_error": found.linear,
        "tie_error": found.tie,
        "cut_error": found.cut,
        "mass_error": masses / found.volume_mass - 1.0,
    }


def restart(given: PairTrial) -> dict[str, float]:
    """Return the difference between a run and one that continues from the middle of it: no bit."""
    first, second = coupled_pair(given), coupled_pair(given)
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


def yielding(given: Yielding) -> dict[str, float]:
    """Return the error of the energy around solder that yields, and what plastic flow and interface have of it."""
    pair = Pair(ratio=given.mesh_ratio)
    models = models_of(pair.mesh(), Materials(solder=SAC405), SCHEMES[given.scheme], FRACTION)
    coupled = Coupled(models.bodies(), models.division.plan, scheme_of(given.scheme))
    for part in coupled.parts:
        part.motion.launch(np.array([0.0, 0.0, given.speed]))
    first = coupled.energies()["kinetic"]
    for _ in range(given.windows):
        coupled.run()
    last = coupled.energies()
    held = sum(last[name] for name in ("kinetic", "internal", "plastic", "hourglass", "interface"))
    return {
        "energy_error": held / first - 1.0,
        "plastic_share": last["plastic"] / first,
        "interface_energy": last["interface"] / first,
    }


def coupled_pair(given: PairTrial, free: bool = False) -> Coupled:
    """Return both models of a trial, coupled."""
    pair = pair_of(given, free)
    if given.scheme == "as_printed":
        return pair.printed(given.step_fraction)
    return pair.coupled(SCHEMES[given.scheme], given.step_fraction)


def pair_of(given: PairTrial, free: bool = False) -> Pair:
    """Return the pair of a trial."""
    board = FR4
    if given.orthotropy:
        board = board.model_copy(update={"young_modulus_out_of_plane": FR4.young_modulus_in_plane / given.orthotropy})
    names = ("substeps", "impedance", "shape", "layers", "columns", "height", "thinnest")
    same = {name: getattr(given, name) for name in names}
    return replace(Pair(**same), ratio=given.mesh_ratio, free=free, board=board)
