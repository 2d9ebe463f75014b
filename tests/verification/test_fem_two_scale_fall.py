"""A board and its package in free fall: both models move alike, and nothing is strained."""

from dataclasses import replace

import numpy as np

from fem.loads import half_sine_drop
from fem.materials.roles import Materials
from fem.mesh import append
from tests.support.fem_models import small_assembly
from tests.support.fem_window import Window


def test_a_body_acceleration_moves_both_models_alike():
    """A meso model that is pushed in every substep runs ahead of its cut, 1 % of the way after these windows."""
    mesh = append(small_assembly(size=1e-3))
    loose = replace(mesh, facets={name: facets for name, facets in mesh.facets.items() if name != "mounting_holes"})
    window = Window(loose, Materials(), 0.9, loads=[half_sine_drop(peak=1.5e4, duration=2e-5)])
    assert window.plan.substeps > 10
    for _ in range(60):
        window.run()
    ways = np.concatenate([part.motion.displacement[:, 2] for part in (window.macro, window.meso)])
    assert np.ptp(ways) < 1e-10 * np.abs(ways).max()
