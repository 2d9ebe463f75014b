"""One-way coupling: a fine block driven by a board with a coarse block, with closed energy balances."""

from dataclasses import replace

import numpy as np

from reflowshock.cases.hard.trials.bodies import motion_of
from reflowshock.cases.hard.trials.coupled import Coupled, Models, models_of, rank_elements_of, surveyed
from reflowshock.cases.hard.trials.pairs import FRACTION, Pair
from reflowshock.fem.coupling.held_velocity import HeldVelocity
from reflowshock.fem.coupling.one_way import OneWay
from reflowshock.fem.division.tables import Tables, model_inputs
from reflowshock.fem.dynamics.energy_balance import EnergyBalance, energy_sums
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.model.assembly import RankElements
from reflowshock.fem.problem.shock import Coupling
from reflowshock.materials.library import SAC405
from reflowshock.materials.roles import Materials

LOADS = [half_sine_drop(peak=1.5e4, duration=1e-5)]
WINDOWS = 200
SOLDER = Materials(solder=SAC405.elastic)
FINE, COARSE = Pair(ratio=2, height=4), Pair(ratio=1, height=2)  # the same block


def driver_of(models: Models) -> tuple[RankElements, Tables]:
    """Return a board with the coarse block that drives the interface of the fine model."""
    whole, _, _ = surveyed(COARSE.mesh(), SOLDER)
    rank_elements, tables = rank_elements_of(model_inputs(whole, "dns")["dns"], SOLDER)
    fine, meso = models.parts["meso"]
    interface = nearest(rank_elements.local.points, fine.local.points[fine.local.locate(meso.interface)])
    return rank_elements, replace(tables, interface=rank_elements.local.nodes[interface].astype(np.int32))


def nearest(points: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Return the number of the point nearest to each target, shape (k,)."""
    return np.array([np.argmin(np.linalg.norm(points - point, axis=1)) for point in targets])


def top(coupled: Coupled) -> np.ndarray:
    """Return the displacement of the upper face of the block, shape (3,) [m]."""
    motion = coupled.meso.motion
    height = motion.body.local.points[:, 2]
    return motion.displacement[height > height.max() - 1e-9].mean(axis=0)


def test_submodel_follows_without_feedback_to_the_driver():
    models = models_of(FINE.mesh(), SOLDER, Coupling(scheme="held_velocity"), FRACTION)
    driver = driver_of(models)
    window = FRACTION * driver[0].steps.min()  # the block is stiffer than the board
    assert window < models.division.plan.window
    plan = replace(models.division.plan, window=window)
    one_way = {"macro": driver, "meso": models.parts["meso"]}
    submodel = Coupled(models._replace(parts=one_way).bodies(), plan, OneWay(), LOADS)
    two_way = Coupled(models.bodies(), plan, HeldVelocity(), LOADS)
    alone = motion_of(submodel.macro.motion.body, plan.window, LOADS)
    balances = [EnergyBalance(limit=1e-9, trivial=0.0) for _ in submodel.parts]
    ours, reference = [], []
    for window in range(WINDOWS):
        for balance, part in zip(balances, submodel.parts, strict=True):
            energies = balance.judge(energy_sums(part, 0.0), window * plan.window)
        submodel.run()
        two_way.run()
        alone.advance()
        alone.update_force()
        ours.append(top(submodel))
        reference.append(top(two_way))
    assert np.array_equal(submodel.macro.motion.displacement, alone.displacement)
    assert energies["external"] > 0.0
    assert energies["interface"] == 0.0
    error = np.linalg.norm(np.array(ours) - reference) / np.linalg.norm(reference)
    assert 1e-4 < error < 0.06  # the error of a block of one column; two-way coupling needs no coarse block
