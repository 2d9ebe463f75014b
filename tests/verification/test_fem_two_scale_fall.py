"""A board and its package in free fall: equal motion of both models without strain."""

from dataclasses import replace

import numpy as np
import pytest

from reflowshock.cases.hard.trials.coupled import Coupled, models_of
from reflowshock.fem.coupling.scheme import scheme_of
from reflowshock.fem.loads.load import half_sine_drop
from reflowshock.fem.mesh.mesh import append
from reflowshock.fem.problem.shock import Coupling
from reflowshock.materials.roles import ELASTIC
from tests.support.fem_models import small_assembly

PULSE = half_sine_drop(peak=1.5e4, duration=2e-5)


@pytest.mark.parametrize(
    ("scheme", "limit"),
    [("held_velocity", 1e-10), ("impulse", 1e-10), ("local_steps", 1e-10), ("gravouil_combescure", 1e-3)],
)
def test_body_acceleration_moves_both_models_equally(scheme, limit):
    """With held velocity, a meso model accelerated in each substep leads its interface by 1 %.

    With Gravouil-Combescure each model integrates the load with its own step; the difference is of second order.
    """
    mesh = append(small_assembly(size=1e-3))
    loose = replace(mesh, facets={name: facets for name, facets in mesh.facets.items() if name != "mounting_holes"})
    models = models_of(loose, ELASTIC, Coupling(scheme=scheme), 0.9)
    coupled = Coupled(models.bodies(), models.division.plan, scheme_of(scheme), [PULSE])
    assert models.division.plan.substeps > 10
    for _ in range(60):
        coupled.run()
    ways = np.concatenate([part.motion.displacement[:, 2] for part in coupled.parts])
    assert np.ptp(ways) < limit * np.abs(ways).max()
