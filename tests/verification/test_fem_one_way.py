"""One way: a fine block driven by a board with a coarse one; nothing comes back, and each energy balance is closed."""

from dataclasses import replace

import numpy as np

from fem.coupling.held_velocity import HeldVelocity
from fem.coupling.one_way import OneWay
from fem.estimate import WindowPlan
from fem.ledger import Ledger, ledger_sums
from fem.loads import half_sine_drop
from fem.materials.library import SAC405
from fem.materials.roles import Materials
from tests.support.fem_bodies import motion_of
from tests.support.fem_coupled import Coupled, Models, bodies_of, split
from tests.support.fem_pairs import FRACTION, Pair

LOADS = [half_sine_drop(peak=1.5e4, duration=1e-5)]
WINDOWS = 200
SOLDER = Materials(solder=SAC405.elastic)
FINE, COARSE = Pair(ratio=2, height=4), Pair(ratio=1, height=2)  # the same block


def fine_models(driver: Models) -> tuple[Models, WindowPlan]:
    """Return the two models with the fine block, and windows that suit the driver, too."""
    models = FINE.models(SOLDER, buffer=2)
    window = FRACTION * min(driver["macro"][0].steps.min(), models["macro"][0].steps.min())
    return models, WindowPlan(window, int(np.ceil(window / (FRACTION * models["meso"][0].steps.min()))), WINDOWS, 1)


def coarse_model() -> Models:
    """Return a board of its own with the coarse block."""
    mesh = COARSE.mesh()
    whole = np.ones(len(mesh.cells), bool)
    return {"macro": split(mesh, SOLDER, whole, whole)["macro"]}


def one_way(driver: Models, models: Models, plan: WindowPlan) -> Coupled:
    """Return the fine block and its buffer, driven by the board with the coarse block."""
    (pieces, tables), (fine, meso) = driver["macro"], models["meso"]
    cut = nearest(pieces.local.points, fine.local.points[fine.local.locate(meso.cut)])
    tables = replace(tables, cut=pieces.local.nodes[cut].astype(np.int32))
    return Coupled(bodies_of({"macro": (pieces, tables), "meso": models["meso"]}), plan, OneWay(), LOADS)


def nearest(points: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    return np.array([np.argmin(np.linalg.norm(points - point, axis=1)) for point in wanted])


def top(coupled: Coupled) -> np.ndarray:
    """Return the displacement of the block's upper face (3,) [m]."""
    motion = coupled.meso.motion
    height = motion.body.local.points[:, 2]
    return motion.displacement[height > height.max() - 1e-9].mean(axis=0)


def test_submodel_follows_and_the_driver_does_not_notice():
    driver = coarse_model()
    models, plan = fine_models(driver)
    submodel, two_way = one_way(driver, models, plan), Coupled(bodies_of(models), plan, HeldVelocity(), LOADS)
    alone = motion_of(submodel.macro.motion.body, plan.window, LOADS)
    ledgers = [Ledger(limit=1e-9, trivial=0.0) for _ in submodel.parts]
    ours, reference = [], []
    for window in range(WINDOWS):
        for ledger, part in zip(ledgers, submodel.parts, strict=True):
            energies = ledger.judge(ledger_sums(part, 0.0), window * plan.window)
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
    assert 1e-4 < error < 0.06  # what a block of one column costs; two-way needs no coarse block
