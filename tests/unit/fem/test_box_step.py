"""Critical steps predicted for a box: the closed form of hexahedra, the elements' own bound for tetrahedra."""

import numpy as np
import pytest

from reflowshock.fem.elements.box_step import box_element_step, diagonal_tetrahedra, with_middle_nodes
from reflowshock.fem.elements.element import element_geometry
from reflowshock.fem.estimates.estimate import box_critical_step
from reflowshock.materials.library import COPPER, FR4

SIZE = np.array([2e-3, 1.5e-3, 0.25e-3])


@pytest.mark.parametrize("material", [FR4, COPPER], ids=["FR4", "copper"])
def test_hexahedra_have_a_closed_form(material):
    step = box_element_step("hexahedron", "incompatible_modes", material, SIZE)
    assert step == pytest.approx(box_critical_step(material, SIZE), rel=1e-10)


def test_tetrahedra_fill_the_box():
    points, cells = diagonal_tetrahedra()
    assert element_geometry(points, cells).volume == pytest.approx(1.0 / 6.0)
    assert element_geometry(*with_middle_nodes(points, cells)).volume == pytest.approx(1.0 / 6.0)


def test_quadratic_tetrahedra_need_shorter_steps():
    linear, quadratic = (
        box_element_step(kind, "incompatible_modes", FR4, SIZE) for kind in ("tetrahedron", "tetrahedron_quadratic")
    )
    assert 0.3 * linear < quadratic < linear < box_critical_step(FR4, SIZE)
