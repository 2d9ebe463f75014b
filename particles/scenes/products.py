"""Files of shapes and flows: HDF5 for scripts and VTU particles for ParaView."""

from collections.abc import Mapping
from pathlib import Path

import h5py
import meshio
import numpy as np

from reflowshock.particles.flows.result import FlowResult, Picture
from reflowshock.particles.reference.young_laplace import Meridian
from reflowshock.particles.steps.shape import JointShape, Snapshot

BODY = "body"
REFERENCE = "reference"
FLOW = "flow.h5"
ARRAYS = ("points", "velocity", "pressure", "triangles")
TIMES = (
    "seconds",
    "particle_steps_per_second",
)  # timings are not written, so that equal shapes give equal files


def write_shapes(path: Path | str, shapes: Mapping[str, JointShape]) -> None:
    """Write shapes, one group each, with history, snapshots and metrics without timings.

    Args:
        path: HDF5 file; replaced if it exists.
        shapes: Name -> shape, whose arrays are written in SI units.
    """
    with h5py.File(path, "w") as file:
        for name, shape in shapes.items():
            _write_shape(file.create_group(name), shape)


def _write_shape(group: h5py.Group, shape: JointShape) -> None:
    group.attrs["verdict"] = shape.verdict
    group.attrs["surface_count"] = len(shape.surface_points)
    for name in ARRAYS:
        group[name] = getattr(shape, name)
    for wall, ring in enumerate(shape.rings):
        group[f"rings/{wall}"] = ring
    for name, column in shape.history.items():
        text = column.dtype.kind == "U"
        group[f"history/{name}"] = column.astype(h5py.string_dtype()) if text else column
    for number, snapshot in enumerate(shape.snapshots):
        subgroup = group.create_group(f"snapshots/{number:04d}")
        subgroup.attrs["time"] = snapshot.time
        subgroup["points"], subgroup["triangles"] = snapshot.points, snapshot.triangles
    for name, (value, unit) in remove_timings(shape.metrics).items():
        subgroup = group.create_group(f"metrics/{name}")
        subgroup.attrs["value"], subgroup.attrs["unit"] = value, unit


def remove_timings(metrics: Mapping[str, tuple]) -> dict[str, tuple]:
    """Return the metrics, name -> (value, unit), without timings; these metrics are equal on all machines."""
    return {name: metric for name, metric in metrics.items() if name not in TIMES}


def write_body(folder: Path, shape: JointShape, reference: Meridian | None) -> None:
    """Write one drop or joint: ``shape.h5``, with its exact meridian if it has one, and ``particles.vtu``.

    Args:
        folder: Existing folder; both files are replaced.
        shape: Shape at rest.
        reference: Exact meridian; None if the shape has none.
    """
    write_shapes(folder / "shape.h5", {BODY: shape})
    if reference is not None:
        with h5py.File(folder / "shape.h5", "a") as file:
            file[REFERENCE] = np.stack((reference.r, reference.z))
    write_particles(folder / "particles.vtu", shape)


def read_body(folder: Path) -> tuple[JointShape, np.ndarray | None]:
    """Read the file ``shape.h5`` of ``write_body``.

    Args:
        folder: Folder that ``write_body`` has written.

    Returns:
        Shape, and radii and heights of the exact meridian, shape (2, k) [m]; None if none was written.
    """
    with h5py.File(folder / "shape.h5", "r") as file:
        return _read_shape(file[BODY]), file[REFERENCE][()] if REFERENCE in file else None


def read_shapes(path: Path | str) -> dict[str, JointShape]:
    """Read the HDF5 file of ``write_shapes``: name -> shape; timings are not in the file."""
    with h5py.File(path, "r") as file:
        return {name: _read_shape(group) for name, group in file.items()}


def _read_shape(group: h5py.Group) -> JointShape:
    arrays = {name: group[name][()] for name in ARRAYS}
    history = {}
    for name, column in group["history"].items():
        history[name] = column.asstr()[()].astype(str) if h5py.check_string_dtype(column.dtype) else column[()]
    snapshots = [
        Snapshot(float(subgroup.attrs["time"]), subgroup["points"][()], subgroup["triangles"][()])
        for _, subgroup in sorted(group["snapshots"].items())
    ]
    metrics = {name: (float(item.attrs["value"]), str(item.attrs["unit"])) for name, item in group["metrics"].items()}
    return JointShape(
        **arrays,
        rings=tuple(ring[()] for _, ring in sorted(group.get("rings", {}).items())),
        surface_points=arrays["points"][: group.attrs["surface_count"]],
        history=history,
        snapshots=snapshots,
        metrics=metrics,
        verdict=str(group.attrs["verdict"]),
    )


def write_particles(path: Path | str, shape: JointShape) -> None:
    """Write the particles at rest and the triangles of the free surface as VTU.

    Point data are velocity [m/s], pressure [Pa], and ``surface``, which is 1 on the free surface and 0 inside.

    Args:
        path: The ``.vtu`` file to write.
        shape: Shape at rest; coordinates are written in metres.
    """
    count = len(shape.points)
    cells = [("vertex", np.arange(count).reshape(-1, 1)), ("triangle", shape.triangles)]
    surface = (np.arange(count) < len(shape.surface_points)).astype(float)
    data = {"velocity": shape.velocity, "pressure": shape.pressure, "surface": surface}
    meshio.Mesh(shape.points, cells, point_data=data).write(path, file_format="vtu")


def write_flow(folder: Path, result: FlowResult) -> None:
    """Write a flow: pictures, history and metrics without timings to ``flow.h5``, final state to ``particles.vtu``.

    Args:
        folder: Existing folder; both files are replaced.
        result: Result of the flow: pictures, history and metrics.
    """
    with h5py.File(folder / FLOW, "w") as file:
        file["walls"] = result.walls
        for name, column in result.history.items():
            file[f"history/{name}"] = column
        for number, picture in enumerate(result.pictures):
            subgroup = file.create_group(f"pictures/{number:04d}")
            subgroup.attrs["time"] = picture.time
            for name in ("points", "velocity", "pressure"):
                subgroup[name] = getattr(picture, name)
        for name, (value, unit) in remove_timings(result.metrics).items():
            subgroup = file.create_group(f"metrics/{name}")
            subgroup.attrs["value"], subgroup.attrs["unit"] = value, unit
    end = result.pictures[-1]
    cells = [("vertex", np.arange(len(end.points)).reshape(-1, 1))]
    data = {"velocity": end.velocity, "pressure": end.pressure}
    meshio.Mesh(end.points, cells, point_data=data).write(folder / "particles.vtu", file_format="vtu")


def read_flow(folder: Path) -> FlowResult:
    """Read the file ``flow.h5`` that ``write_flow`` wrote into a folder.

    Returns:
        Pictures, walls, history and metrics; without timings and texts, which are not in the file.
    """
    with h5py.File(folder / FLOW, "r") as file:
        pictures = [
            Picture(float(item.attrs["time"]), item["points"][()], item["velocity"][()], item["pressure"][()])
            for _, item in sorted(file["pictures"].items())
        ]
        history = {name: column[()] for name, column in file["history"].items()}
        metrics = {
            name: (float(item.attrs["value"]), str(item.attrs["unit"])) for name, item in file["metrics"].items()
        }
        return FlowResult(pictures, file["walls"][()], history, metrics)
