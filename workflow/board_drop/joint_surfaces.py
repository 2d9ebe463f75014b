"""Closed surfaces of all joints of an array: as they froze, as the user gives them, of two that are bridged."""

from pathlib import Path
from typing import TYPE_CHECKING

from reflowshock.workflow.board_drop.bridged_joints import BETWEEN
from reflowshock.workflow.case.run import Run
from reflowshock.workflow.package.case import PackageCase
from reflowshock.workflow.process.products import read_json
from reflowshock.workflow.reflow.joints import refuse_joints_without_mesh

if TYPE_CHECKING:
    from reflowshock.particles.steps.shape import JointShape


def write_surfaces(run: Run[PackageCase], folder: Path) -> dict[str, dict]:
    """Write the surface of each joint, in its own orientation, and of bridged ones in common; return their measures.

    Raises:
        ReflowError: joints are open: they have no surface between their pads.
    """
    from reflowshock.meshing.board.pads import read_pads
    from reflowshock.meshing.surface.closed_surface import measure, write_surface
    from reflowshock.meshing.surface.user_surface import file_volume, load_surface
    from reflowshock.particles.scenes.orientation import Orientation, oriented
    from reflowshock.particles.scenes.products import read_shapes

    package, joints = run.case.package, read_json(run.folder / "reflow/joints.json")
    sites = {site.name: site for site in read_pads(run.folder / "reflow/pads.json")}
    flowed = {name: joint for name, joint in joints.items() if name not in package.surfaces}
    refuse_joints_without_mesh(flowed, ("open",))
    shapes = read_shapes(run.folder / "reflow/shapes.h5")
    bodies = {name: shape for name, shape in shapes.items() if BETWEEN in name}
    for name, joint in flowed.items():
        if joint["verdict"] != "bridged":
            bodies[name] = oriented(shapes[joint["shape"]], Orientation(joint["turn"], joint["mirror"]))
    measures: dict[str, dict] = {}
    for name, shape in bodies.items():
        closed = _closed(shape)
        write_surface(folder / f"{name}.vtu", closed)
        own = measure(closed)
        measures[name] = {**own, "volume_error": own["volume"] / shape.metrics["volume"][0] - 1.0}
    for name, path in package.surfaces.items():
        closed = load_surface(Path(path), package.surface_unit, sites[name])
        write_surface(folder / f"{name}.vtu", closed)
        own = measure(closed)
        change = own["volume"] / file_volume(Path(path), package.surface_unit) - 1.0
        measures[name] = {**own, "given": path, "volume_change": change}
    return measures


def _closed(shape: "JointShape"):
    """Close the free surface of a shape on all its pads."""
    from reflowshock.meshing.surface.closed_surface import close_rings

    return close_rings(shape.surface_points, shape.triangles, shape.rings)
