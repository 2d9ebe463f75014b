import meshio
import numpy as np
import pytest

from reflowshock.particles.core.geometry import JointGeometry
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from reflowshock.particles.scenes.products import TIMES, read_shapes, remove_timings, write_particles, write_shapes
from reflowshock.particles.scenes.reflow import solve_joint


@pytest.fixture(scope="module")
def shape():
    """Return the shape of a coarse joint at rest."""
    numerics = SolderNumerics(spacing=1e-4)
    return solve_joint(JointGeometry(0.31e-3, 0.24e-3, 0.24e-3), Solder(volume=0.0724e-9, numerics=numerics))


def test_shapes_survive_the_file(tmp_path, shape):
    write_shapes(tmp_path / "shapes.h5", {"one": shape})
    back = read_shapes(tmp_path / "shapes.h5")["one"]
    for name in ("points", "velocity", "pressure", "surface_points", "triangles", "ring_board", "ring_package"):
        assert np.array_equal(getattr(back, name), getattr(shape, name))
    assert back.triangles.dtype == np.int32
    assert back.metrics == remove_timings(shape.metrics)
    assert shape.metrics.keys() - back.metrics.keys() == set(TIMES)
    assert back.verdict == shape.verdict
    assert set(back.history) == set(shape.history)
    assert list(back.history["binding"]) == list(shape.history["binding"])
    assert [snapshot.time for snapshot in back.snapshots] == [snapshot.time for snapshot in shape.snapshots]
    assert np.array_equal(back.snapshots[-1].points, shape.snapshots[-1].points)


def test_particles_open_as_vtu(tmp_path, shape):
    write_particles(tmp_path / "joint.vtu", shape)
    mesh = meshio.read(tmp_path / "joint.vtu")
    assert mesh.points == pytest.approx(shape.points)
    assert mesh.point_data["surface"].sum() == len(shape.surface_points)
    assert mesh.cells_dict["triangle"].shape == shape.triangles.shape
