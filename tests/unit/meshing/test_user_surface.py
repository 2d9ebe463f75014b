"""Surfaces from user files: accepted if they enclose a joint, else rejected with fault, position and allowed range."""

import meshio
import numpy as np
import pytest

from reflowshock.cases.hard.trials import joints
from reflowshock.cases.hard.trials.packages import MM, board, package, side_of
from reflowshock.cases.hard.trials.surfaces import barrel, of_level_set, with_void
from reflowshock.meshing.board.pads import pad_table
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.meshing.joint.solder_mesh import joint_quality, mesh_joint
from reflowshock.meshing.surface.closed_surface import SurfaceError, enclosed_volume, measure
from reflowshock.meshing.surface.user_surface import file_volume, load_surface

SITE = {site.name: site for site in pad_table(package(), board(), Warpage())}["A4"]
SHAPE = barrel(SITE.gap, 0.04 * MM)
TURN = np.array([[0.96, -0.28, 0.0], [0.28, 0.96, 0.0], [0.0, 0.0, 1.0]])


def write(folder, points, triangles, name="joint.stl", scale=1.0 / MM):
    """Write triangles to a file in a folder, in mm; return the path."""
    meshio.write(folder / name, meshio.Mesh(np.asarray(points) * scale, [("triangle", np.asarray(triangles))]))
    return folder / name


def tilted(points, angle=0.1):
    """Turned about the x axis and pushed away."""
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    return points @ turn.T + [3.0 * MM, -1.0 * MM, 7.0 * MM]


@pytest.mark.parametrize("suffix", ["stl", "ply", "vtu"])
def test_any_format_gives_the_joint_in_its_own_frame(tmp_path, suffix):
    path = write(tmp_path, tilted(SHAPE.points), SHAPE.triangles, f"joint.{suffix}")
    surface = load_surface(path, "mm", SITE)
    assert enclosed_volume(surface) == pytest.approx(enclosed_volume(SHAPE), rel=1e-5)
    expected, measured = measure(SHAPE), measure(surface)
    for name in ("standoff", "max_width", "contact_radius_board", "contact_radius_package"):
        assert measured[name] == pytest.approx(expected[name], rel=1e-5)
    lower = surface.points[np.unique(surface.triangles[surface.boundary == 1])]
    assert np.abs(lower).max(axis=0)[2] == 0.0
    assert lower.mean(axis=0) == pytest.approx(0.0, abs=1e-3 * MM)


def test_it_is_meshed_as_the_same_shape_from_a_reflow_is(tmp_path):
    surface = load_surface(write(tmp_path, tilted(SHAPE.points), SHAPE.triangles), "mm", SITE)
    side = side_of(Warpage(), package())
    imported, reflowed = (joint_quality(mesh_joint(shape, SITE, package(), side)) for shape in (surface, SHAPE))
    assert imported["method"] == "swept"
    assert imported["minimum_scaled_jacobian"] == pytest.approx(reflowed["minimum_scaled_jacobian"], rel=0.05)


def test_a_void_and_noise_are_kept(tmp_path):
    hollow = with_void(SHAPE, (0.0, 0.05 * MM, 0.5 * SITE.gap), 0.06 * MM)
    noisy = hollow.points + np.random.default_rng(2).normal(0.0, 1e-3 * MM, hollow.points.shape)
    surface = load_surface(write(tmp_path, noisy, hollow.triangles), "mm", SITE)
    assert enclosed_volume(surface) == pytest.approx(enclosed_volume(hollow), rel=0.02)
    quality = joint_quality(mesh_joint(surface, SITE, package(), side_of(Warpage(), package())))
    assert quality["method"] == "free-form"
    assert max(quality["volume_error"], quality["contact_area_error"]) < 3e-3


def test_heights_are_stretched_to_the_gap_and_tilt_of_the_site(tmp_path):
    from dataclasses import replace

    site = replace(SITE, gap=1.05 * SITE.gap, tilt=(0.04, -0.03))
    path = write(tmp_path, SHAPE.points, SHAPE.triangles)
    surface = load_surface(path, "mm", site)
    assert file_volume(path, "mm") == pytest.approx(enclosed_volume(SHAPE), rel=1e-5)
    assert enclosed_volume(surface) == pytest.approx(1.05 * enclosed_volume(SHAPE), rel=1e-3)
    upper = surface.points[np.unique(surface.triangles[surface.boundary == 2])]
    slope = np.tan(0.05) / 0.05 * np.array([0.03, 0.04])
    assert upper[:, 2] == pytest.approx(site.gap + upper[:, :2] @ slope, rel=1e-5)


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (joints.hole, r"open edge: a hole \(3 such edges, allowed 0\), first at \("),
        (joints.flipped, r"triangle that faces another way than its neighbour"),
        (joints.inside_out, r"oriented inwards"),
        (joints.doubled, r"edge of more than two triangles: a double shell"),
        (joints.two_shells, r"second shell that faces outwards, allowed are voids"),
        (joints.crossing, r"surface crosses itself at \("),
        (joints.void_outside, r"void that lies outside the body"),
        (joints.round_top, r"its upper end, z = .* is flat on a disc of radius"),
        (joints.far_too_high, r"flat ends are .* m apart, allowed"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_faults_are_refused_by_place(tmp_path, fault, message):
    path = write(tmp_path, *fault(SHAPE.points, SHAPE.triangles.astype(np.int64)))
    with pytest.raises(SurfaceError, match=r"joint A4, .*joint\.stl: .*" + message):
        load_surface(path, "mm", SITE)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7])
def test_a_ring_that_is_turned_inside_out_is_refused(tmp_path, share):
    points = SHAPE.points.copy()
    heights = np.unique(np.round(points[:, 2], 12))
    ring = np.abs(points[:, 2] - heights[np.argmin(np.abs(heights - share * SITE.gap))]) < 1e-11
    points[ring, :2] *= -1.0
    with pytest.raises(SurfaceError, match="surface crosses itself"):
        load_surface(write(tmp_path, points, SHAPE.triangles), "mm", SITE)


@pytest.mark.parametrize("suffix", ["ply", "vtu", "stl"])
@pytest.mark.parametrize("value", [3e38, 1e20, 1e5])
def test_a_vertex_far_away_is_named(tmp_path, suffix, value):
    points = SHAPE.points.copy()
    points[11, 0] = value
    with pytest.raises(SurfaceError, match=r"vertex \d+ lies .* m away from the others, allowed up to 1 m"):
        load_surface(write(tmp_path, points, SHAPE.triangles, f"joint.{suffix}", 1.0), "m", SITE)


@pytest.mark.parametrize("vertex", [-1, 10**9])
def test_a_triangle_of_vertices_that_are_not_there_is_named(tmp_path, vertex):
    triangles = SHAPE.triangles.astype(np.int32)
    triangles[7, 1] = vertex
    with pytest.raises(SurfaceError, match=rf"triangle 7 has the vertices \d+, {vertex}, \d+, allowed 0 to"):
        load_surface(write(tmp_path, SHAPE.points, triangles, "joint.ply"), "mm", SITE)


def test_another_unit_is_refused_and_the_right_one_named(tmp_path):
    path = write(tmp_path, SHAPE.points, SHAPE.triangles, scale=1.0e6)
    with pytest.raises(SurfaceError, match=r"height 0\.31 m with lengths in mm, allowed .*; is it in um\?"):
        load_surface(path, "mm", SITE)


def test_files_without_a_surface_are_rejected(tmp_path):
    for name, message in (("joint.obj", "suffix .obj, allowed .stl, .ply, .vtu"), ("none.stl", "no such file")):
        with pytest.raises(SurfaceError, match=message):
            load_surface(tmp_path / name, "mm", SITE)
    (tmp_path / "text.ply").write_text("not a surface\n")
    with pytest.raises(SurfaceError, match="cannot be read"):
        load_surface(tmp_path / "text.ply", "mm", SITE)
    box = meshio.Mesh(np.eye(4, 3), [("quad", np.array([[0, 1, 2, 3]]))])
    meshio.write(tmp_path / "quads.vtu", box)
    with pytest.raises(SurfaceError, match="contains quad, allowed triangles"):
        load_surface(tmp_path / "quads.vtu", "mm", SITE)


def test_marching_cubes_are_taken(tmp_path):
    def inside(x, y, z):
        return 0.34 * MM - np.sqrt(x**2 + y**2 + (z - 0.5 * SITE.gap) ** 2)

    voxels = of_level_set(inside, SITE.gap, (0.4 * MM, 0.4 * MM), across=12)
    surface = load_surface(write(tmp_path, voxels.points @ TURN.T, voxels.triangles), "mm", SITE)
    quality = joint_quality(mesh_joint(surface, SITE, package(), side_of(Warpage(), package())))
    assert quality["method"] == "swept"
    assert quality["shape_deviation"] < 0.03 * MM
