"""Joint measures with imprinted pads are insensitive to the mesh; ties to boxes that ignore the pads are not accurate.

benchmarks/imprinted_pads.py also halves all elements, with plastic solder.
"""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.imprinted_patch import CHEAPEST, IMPRINTED, TIED, Problem, ends, half_of, patch

MEASURES = ("axial_force", "shear_force", "bending_moment", "von_mises:25um")


def measures(mesh, turned=None):
    """Return the elastic measures at the board end of the joint."""
    problem = Problem(patch(mesh)[0], False, turned=turned)
    return dict(ends(problem, problem.solve()))["board"]


@pytest.fixture(scope="module")
def imprinted():
    """Return the measures of the joint with imprinted pads."""
    return measures(IMPRINTED)


@pytest.mark.long
def test_boxes_shifted_by_half_an_element_change_little(imprinted):
    shifted = measures(replace(IMPRINTED, shift=0.5))
    assert shifted == pytest.approx(imprinted, rel=0.02)


def test_rotated_motion_changes_little():
    along, turned = (measures(IMPRINTED, angle) for angle in (0.0, np.radians(45.0)))
    assert turned == pytest.approx(along, rel=0.005)


@pytest.mark.long
def test_elements_two_thirds_as_long_change_little(imprinted):
    problem = Problem(half_of(patch(IMPRINTED.times(2.0 / 3.0))[0]), False)
    finer = dict(ends(problem, problem.solve()))["board"]
    assert {name: imprinted[name] / finer[name] - 1.0 for name in MEASURES} == pytest.approx(
        {"axial_force": 0.032, "shear_force": 0.031, "bending_moment": 0.029, "von_mises:25um": 0.027}, abs=0.005
    )


@pytest.mark.long
def test_free_form_joint_in_its_column_has_the_measures_of_a_swept_joint(imprinted):
    free_form = replace(IMPRINTED, joint=CHEAPEST | {"layers": 7}, swept=False)
    assert measures(free_form) == pytest.approx(imprinted, rel=0.03)
    tied = measures(replace(free_form, box=TIED.box, imprint=None))
    excess = {name: tied[name] / imprinted[name] - 1.0 for name in MEASURES}
    assert excess["axial_force"] > 0.25
    assert min(excess[name] for name in ("shear_force", "bending_moment", "von_mises:25um")) > 0.7


def test_a_tie_to_boxes_that_ignore_the_pad_is_too_stiff(imprinted):
    tied = measures(TIED)
    excess = {name: tied[name] / imprinted[name] - 1.0 for name in MEASURES}
    assert excess["axial_force"] > 0.25
    assert min(excess[name] for name in ("shear_force", "bending_moment", "von_mises:25um")) > 0.7
