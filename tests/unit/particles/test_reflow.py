import numpy as np
import pytest

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder, SolderEffects, SolderNumerics
from reflowshock.particles.scenes.flow_setup import build_physics
from reflowshock.particles.scenes.reflow import solve_joint
from reflowshock.particles.steps.rest import NotAtRest

JOINT = JointGeometry(0.31e-3, 0.24e-3, 0.24e-3)
COARSE = SolderNumerics(spacing=1e-4)
EFFECTS = ("gravity", "inertia", "viscosity", "surface_tension", "wall_adhesion")


def test_progress_rises_to_one_and_snapshots_are_reported():
    fractions, snapshots = [], []
    shape = solve_joint(JOINT, Solder(volume=0.0724e-9, numerics=COARSE), fractions.append, snapshots.append)
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert len(snapshots) == len(shape.snapshots) >= 2
    assert snapshots[0].time == 0.0
    lengths = {len(column) for column in shape.history.values()}
    assert lengths == {int(shape.metrics["steps"][0])}


def test_same_input_gives_the_same_shape():
    first, second = (solve_joint(JOINT, Solder(volume=0.0724e-9, numerics=COARSE)) for _ in range(2))
    assert np.array_equal(first.points, second.points)


def test_an_effect_that_is_off_is_absent():
    none = build_physics(Solder(volume=1e-9), dict.fromkeys(EFFECTS, False), ())
    every = build_physics(Solder(volume=1e-9), dict.fromkeys(EFFECTS, True), ())
    assert [len(x) for x in (none.forces, none.operators, none.momenta, none.events)] == [0, 1, 0, 0]
    assert [len(x) for x in (every.forces, every.operators, every.momenta, every.events)] == [3, 3, 1, 1]


def test_too_few_steps_are_an_error_that_says_where_it_stopped():
    numerics = SolderNumerics(spacing=1e-4, max_steps=2)
    with pytest.raises(NotAtRest, match=r"2 steps \(solder.numerics.max_steps\) at time .* spacings"):
        solve_joint(JOINT, Solder(volume=0.0724e-9, numerics=numerics))


def test_without_wall_adhesion_the_rims_stay_and_their_angles_are_known():
    effects = SolderEffects(wall_adhesion="off")
    neutral = solve_joint(JOINT, Solder(volume=0.0724e-9, numerics=COARSE, effects=effects)).metrics
    plain = solve_joint(JOINT, Solder(volume=0.0724e-9, numerics=COARSE)).metrics
    for name in ("max_width", "contact_angle_board"):
        assert neutral[name][0] == pytest.approx(plain[name][0], rel=1e-3)


def test_viscosity_and_inertia_do_not_change_the_shape_at_rest():
    effects = SolderEffects(viscosity="on", inertia="on")
    plain = solve_joint(JOINT, Solder(volume=0.0724e-9, numerics=COARSE))
    full = solve_joint(JOINT, Solder(volume=0.0724e-9, numerics=COARSE, effects=effects))
    assert full.metrics["max_width"][0] == pytest.approx(plain.metrics["max_width"][0], rel=1e-3)
