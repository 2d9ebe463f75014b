"""Solder on the mask of a tilted package: its wetted disc lies off the pad, whose height stays the gap."""

from dataclasses import replace

import numpy as np
import pytest

from reflowshock.cases.hard.trials.joints import Underside
from reflowshock.cases.hard.trials.packages import MM, package
from reflowshock.cases.hard.trials.surfaces import barrel, laid_between
from reflowshock.meshing.board.pads import PadSite
from reflowshock.meshing.joint.joint_mesh import JointMeshError
from reflowshock.meshing.joint.solder_mesh import mesh_joint
from reflowshock.meshing.surface.closed_surface import ClosedSurface, pad_planes
from tests.support.many_joints import hooked

SLOPE, ASIDE, PAD = 0.02, 0.05 * MM, 0.24 * MM


def site_below(surface: ClosedSurface) -> PadSite:
    """A joint whose package pad is centred over the board's, wherever the solder has gone."""
    height = float(pad_planes(surface).height(0.0, 0.0))
    return PadSite("A1", 0, 0, 0.0, 0.0, height, PAD, PAD, PAD, PAD, 0.02 * MM, tilt=(0.0, -float(np.arctan(SLOPE))))


def meshed(surface: ClosedSurface, site: PadSite):
    """Return the mesh of a closed surface at a pad site."""
    whole = package()
    return mesh_joint(surface, site, whole, Underside(pad_planes(surface), 0.0, 0.0, 2.0 * whole.copper.thickness))


@pytest.fixture
def overflowed() -> ClosedSurface:
    """Wetted discs wider than the pads, the upper one next to its pad."""
    return laid_between(barrel(0.25 * MM, 0.06 * MM, 0.26 * MM, 0.28 * MM), (ASIDE, 0.0), (SLOPE, 0.0))


def test_the_gap_is_that_of_the_pad_not_of_the_wetted_disc(overflowed):
    site = site_below(overflowed)
    assert pad_planes(overflowed).gap - site.gap == pytest.approx(SLOPE * ASIDE, rel=1e-6)
    assert site.gap * 1.0e-3 < SLOPE * ASIDE  # the tolerance of the gap
    mesh = meshed(overflowed, site)
    assert (mesh.record["method"], mesh.record["tries"]) == ("swept", [])
    head = mesh.points[np.unique(mesh.facets["pad_package@A1"])]
    assert head[:, 2] - site.z_board == pytest.approx(site.gap + SLOPE * head[:, 0], rel=1e-9)


def test_another_gap_of_the_pad_is_still_refused(overflowed):
    site = site_below(overflowed)
    with pytest.raises(JointMeshError, match=r"joint A1: its surface spans z = 0 to 0\.000249\d* m, allowed"):
        meshed(overflowed, replace(site, gap=pad_planes(overflowed).gap))


def test_solder_that_folds_over_beneath_a_tilted_package_is_filled():
    folded = laid_between(hooked(np.random.default_rng(1), 0), (ASIDE, 0.0), (SLOPE, 0.0))
    site = site_below(folded)
    mesh = meshed(folded, site)
    assert mesh.record["method"] == "free-form"
    assert max(mesh.volume_error, mesh.record["standoff_error"], mesh.record["contact_area_error"]) <= 3.0e-3
    head = mesh.points[np.unique(mesh.facets["pad_package@A1"])]
    assert head[:, 2] - site.z_board == pytest.approx(site.gap + SLOPE * head[:, 0], rel=1e-6)
