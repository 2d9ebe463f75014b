"""The part of a hexahedron between two planes, and the frame and modulus of a pad's face."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from reflowshock.cases.hard.trials.grids import grid, joint_mesh
from reflowshock.fem.errors import MeshError
from reflowshock.fem.kernels.hexahedron import SIDES
from reflowshock.fem.mesh.mesh import MeshData
from reflowshock.fem.mesh.pad_faces import polar_moment, section_frame
from reflowshock.fem.mesh.pad_layer import fraction_below, octant_volumes
from reflowshock.fem.mesh.watch_table import whole_watch

UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("thickness", [0.1, 0.5, 0.8, 1.0, 3.0])
def test_a_layer_cuts_a_box_by_its_height(thickness):
    box = 0.5 * (SIDES + 1.0) * [2.0, 3.0, 1.0]
    volumes = octant_volumes(box[None], np.zeros(3), UP, thickness)[0]
    lower = 1.5 * min(thickness, 0.5)
    assert volumes[:4] == pytest.approx(lower)
    assert volumes[4:] == pytest.approx(1.5 * min(thickness, 1.0) - lower, abs=1e-14)


def test_what_lies_behind_the_pad_does_not_count():
    box = 0.5 * (SIDES + 1.0) - [0.0, 0.0, 0.25]
    assert octant_volumes(box[None], np.zeros(3), UP, 0.5).sum() == pytest.approx(0.5)


def test_slanted_layers_add_up_and_agree_with_many_points():
    rng = np.random.default_rng(3)
    cube = 0.5 * (SIDES + 1.0)
    normal = Rotation.from_rotvec([0.4, -0.9, 0.3]).apply(UP)
    lowest = cube[np.argmin(cube @ normal)]
    thin, thick = (octant_volumes(cube[None], lowest, normal, t)[0] for t in (0.6, 5.0))
    assert thick == pytest.approx(1.0 / 8.0)
    points = rng.random((400_000, 3))
    inside = (points - lowest) @ normal < 0.6
    octant = (points > 0.5) @ [1, 2, 4]
    assert np.bincount(octant, inside, 8) / len(points) == pytest.approx(thin, abs=2e-3)


def test_tetrahedra_are_cut_exactly():
    heights = np.array([0.0, 1.0, 1.0, 1.0])
    assert fraction_below(heights, 0.5) == pytest.approx(0.125)
    assert fraction_below(1.0 - heights, 0.5) == pytest.approx(0.875)
    assert fraction_below(np.array([0.0, 0.0, 1.0, 1.0]), 0.5) == pytest.approx(0.5)
    assert fraction_below(np.array([0.0, 0.0, 2.0, 1.0]), 3.0) == 1.0
    assert fraction_below(heights, -1e-9) == 0.0


def test_sections_of_a_leaning_joint_have_its_frame():
    mesh = joint_mesh("A1", 1e-3, 2e-3)
    turn = Rotation.from_rotvec([0.0, 0.2, 0.0])
    tilted = MeshData(turn.apply(mesh.points), mesh.cells, mesh.part, mesh.part_names, mesh.facets)
    faces = whole_watch(tilted, 25e-6).faces
    assert np.allclose(faces.frame, turn.as_matrix().T, atol=1e-12)
    assert faces.area == pytest.approx(0.4e-3**2)
    assert faces.modulus == pytest.approx(0.4e-3**4 / 12.0 / (0.2e-3 * np.sqrt(2.0)))
    assert whole_watch(tilted, 25e-6).layer.volume == pytest.approx(25e-6 * 0.4e-3**2)


def test_second_moment_of_a_rectangle():
    points, cells = grid([-1.0, 0.5, 1.0], [-2.0, 2.0], [0.0, 1.0])
    facets = points[cells[:, [0, 1, 3, 2]]][:, :, :2]
    assert polar_moment(facets) == pytest.approx(2.0 * 4.0 * (4.0 + 16.0) / 12.0)


def test_frames_are_right_handed_whatever_the_normal():
    normals = np.array([[1.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.1, -0.2, -5.0]])
    frames = section_frame(normals)
    assert np.allclose(frames @ frames.transpose(0, 2, 1), np.eye(3))
    assert np.allclose(np.linalg.det(frames), 1.0)


def test_a_layer_thicker_than_a_joint_is_refused():
    with pytest.raises(
        MeshError, match=r"shock\.joint_layer = 400 um is thicker than .* joint A1, 300 um .* up to 300"
    ):
        whole_watch(joint_mesh("A1", 0.0, 0.0), 4e-4)
