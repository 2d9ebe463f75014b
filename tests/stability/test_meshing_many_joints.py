"""Samples of two hundred joints: meshed within limits or rejected with a reason (all: benchmarks/remeshing.py)."""

import numpy as np
import pytest

from reflowshock.cases.hard.trials.joints import Underside, sites_of
from reflowshock.cases.hard.trials.packages import package
from reflowshock.meshing.board.pad_planes import PadPlanes
from reflowshock.meshing.joint.solder_mesh import JointMeshError, mesh_joint
from tests.support.many_joints import COUNTS, barrel, mesh, outcome, samples

LARGEST_ERROR, SMALLEST_JACOBIAN = 3.0e-3, 0.2
SWEPT = {"barrel", "hourglass", "shifted", "tilted", "overflow", "lobed"}


@pytest.fixture(scope="module", params=[30, pytest.param(10, marks=pytest.mark.long)])
def outcomes(request):
    """Return the outcomes of every thirtieth joint of the swept kinds, or of every tenth of all kinds."""
    chosen = (sample for sample in samples(every=request.param) if sample.kind in SWEPT or request.param == 10)
    return [outcome(sample) for sample in chosen]


def test_there_are_two_hundred():
    assert sum(COUNTS.values()) == 200


def test_meshed_joints_are_within_the_limits(outcomes):
    for record in outcomes:
        if record["method"] == "refused":
            assert record["reason"].startswith("joint A1")
            continue
        assert (
            max(record[name] for name in ("volume_error", "standoff_error", "contact_area_error")) <= LARGEST_ERROR
        ), record
        assert record["scaled_jacobian"] >= SMALLEST_JACOBIAN, record


def test_sweepable_joints_are_swept_and_the_rest_is_filled(outcomes):
    method = {record["kind"]: record["method"] for record in outcomes}
    assert method.keys() in (SWEPT, COUNTS.keys())
    assert method == {kind: "swept" if kind in SWEPT else "free-form" for kind in method}


def test_ends_of_tilted_joints_lie_exactly_in_both_planes():
    for sample in (sample for sample in samples(every=10) if sample.kind == "tilted"):
        made, (site,) = mesh(sample), sample.sites
        planes = PadPlanes.fit(sample.surface.points, sample.surface.triangles[sample.surface.boundary == 2])
        head, foot = (made.points[made.facets[f"pad_{side}@{site.name}"]] for side in ("package", "board"))
        assert foot[..., 2] == pytest.approx(site.z_board, abs=1e-15)
        assert head[..., 2] - site.z_board == pytest.approx(planes.height(head[..., 0], head[..., 1]), rel=1e-9)


def test_a_joint_between_other_planes_than_its_own_is_refused():
    surface = barrel(np.random.default_rng(0), 0)
    (site,) = sites_of(surface, pair=False)
    planes = PadPlanes(1.1 * site.gap, np.zeros(2), np.zeros(2))
    side = Underside(planes, 0.0, 0.0, site.z_board + package().copper.thickness)
    with pytest.raises(JointMeshError, match=r"joint A1: the package is .* m above its upper face, allowed"):
        mesh_joint(surface, site, package(), side)
