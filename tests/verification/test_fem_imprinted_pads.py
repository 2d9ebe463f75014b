"""Measures of a joint in its columns stay where boxes move; tied to boxes that ignore its pads it is far off.

The figures of the converged mesh are those of benchmarks/imprinted_pads.py with every element halved.
"""

from dataclasses import replace

import pytest

from tests.support.imprinted_patch import IMPRINTED, TIED, Problem, ends, patch

MEASURES = ("axial_force", "shear_force", "bending_moment", "von_mises:25um")


def measures(mesh):
    """Of the end at the board, elastic."""
    problem = Problem(patch(mesh)[0], False)
    return dict(ends(problem, problem.solve()))["board"]


@pytest.fixture(scope="module")
def imprinted():
    return measures(IMPRINTED)


def test_boxes_shifted_by_half_an_element_change_little(imprinted):
    shifted = measures(replace(IMPRINTED, shift=0.5))
    assert shifted == pytest.approx(imprinted, rel=0.02)


def test_a_tie_to_boxes_that_ignore_the_pad_is_too_stiff(imprinted):
    tied = measures(TIED)
    excess = {name: tied[name] / imprinted[name] - 1.0 for name in MEASURES}
    assert excess["axial_force"] > 0.25
    assert min(excess[name] for name in ("shear_force", "bending_moment", "von_mises:25um")) > 0.7
