"""Stage ``reflow``: joints between rigid plates, or coupled with board and package during heating."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.workflow.case.run import Findings, Run
from reflowshock.workflow.package import findings
from reflowshock.workflow.package.case import PackageCase, joint_geometries
from reflowshock.workflow.package.given_surfaces import given_records
from reflowshock.workflow.process.products import write_json
from reflowshock.workflow.process.terminal import progress_bar
from reflowshock.workflow.reflow import joints as pool
from reflowshock.workflow.reflow.heated import reflow_heated
from reflowshock.workflow.reflow.processes import open_pool

if TYPE_CHECKING:
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.particles.core.geometry import JointGeometry
    from reflowshock.particles.steps.shape import JointShape


@dataclass(frozen=True, slots=True)
class Reflowed:
    """Joints at rest.

    Attributes:
        pads: Pad table at solidification.
        geometries: Geometry by joint name.
        groups: Groups of equal joints.
        shapes: Shape by name of the first joint of a group.
        findings: Metrics and health checks of the computation, without those of the shapes.
        structure: Arrays of ``structure.npz``; empty between rigid plates at rest.
    """

    pads: "list[PadSite]"
    geometries: "Mapping[str, JointGeometry]"
    groups: list[pool.JointGroup]
    shapes: "dict[str, JointShape]"
    findings: Findings
    structure: dict[str, np.ndarray] = field(default_factory=dict)


def reflow(run: Run[PackageCase], folder: Path) -> Findings:
    """Reflow the solder of the array; write shapes, records of the joints, and the pad table at solidification.

    Args:
        run: Case, cores, and run folder from which the products of earlier stages are read.
        folder: Folder into which the products of the stage are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.meshing.board.pads import lift_pads, read_pads, write_pads
    from reflowshock.particles.parameters.effects import decide_effects
    from reflowshock.particles.scenes.products import write_shapes

    case, solder = run.case, run.case.solder
    drawn = read_pads(run.folder / "geometry/pads.json")
    lifted_pads = lift_pads(drawn, case.package, case.warpage)
    result = (
        _between_plates(run, lifted_pads) if case.thermal is None else _heated(run, lifted_pads, folder / "heated.msh")
    )
    flowed = {name: result.geometries[name] for group in result.groups for name in group.members}
    joints = pool.joint_records(result.groups, flowed, result.shapes) | given_records(case.package, result.pads, flowed)
    joints = {pad.name: joints[pad.name] for pad in result.pads}
    touching = pool.mark_bridges(joints, result.pads, mirrored=case.board.symmetry == "quarter")
    write_shapes(folder / "shapes.h5", result.shapes | pool.bridge_shapes(touching, flowed, solder))
    write_json(folder / "joints.json", joints)
    write_pads(folder / "pads.json", result.pads)
    if result.structure:
        _write_structure(folder, result.structure)
    highest = max(result.geometries.values(), key=lambda geometry: geometry.gap)
    of_shapes = findings.of_reflow(joints, decide_effects(highest, solder))
    return Findings(
        of_shapes.metrics | result.findings.metrics,
        of_shapes.health | result.findings.health,
        of_shapes.effects | result.findings.effects,
        result.findings.continued,
    )


def _between_plates(run: Run[PackageCase], pads: "list[PadSite]") -> Reflowed:
    """Reflow each distinct joint between rigid plates at the pads, except joints with a given surface."""
    geometries = joint_geometries(pads)
    surfaces = run.case.package.surfaces
    groups = pool.distinct_joints({name: geometries[name] for name in geometries if name not in surfaces})
    distinct = {group.name: group.geometry for group in groups}
    with (
        open_pool(run, len(distinct)) as workers,
        progress_bar(f"reflow of {len(distinct)} distinct joints") as progress,
    ):
        shapes, continued = pool.solve_joints(distinct, run.case.solder, workers, progress, run.checkpoints("reflow"))
    computation = Findings(continued=f"{continued} of {len(distinct)} joints" if continued else "")
    return Reflowed(pads, geometries, groups, shapes, computation)


def _heated(run: Run[PackageCase], pads: "list[PadSite]", mesh: Path) -> Reflowed:
    """Reflow all joints in load steps of temperature, coupled with a mesh of board and package."""
    from reflowshock.meshing.board.assembly import write_heated_assembly

    assert run.case.thermal is not None
    write_heated_assembly(run.case.package, run.case.board, mesh)
    heated = reflow_heated(run, run.case.thermal, pads, mesh)
    solid = [
        replace(pad, gap=geometry.gap, offset=geometry.offset, tilt=geometry.tilt)
        for pad, geometry in zip(pads, heated.geometries.values(), strict=True)
    ]
    computation = Findings(heated.metrics, heated.health, heated.effects, heated.continued)
    return Reflowed(solid, heated.geometries, heated.groups, heated.shapes, computation, heated.structure)


def _write_structure(folder: Path, structure: Mapping[str, np.ndarray]) -> None:
    """Write the displacements of board and package to ``structure.npz``, and to ``structure.vtu`` for ParaView."""
    import meshio
    from scipy.spatial import cKDTree

    np.savez_compressed(folder / "structure.npz", **structure)
    drawn = meshio.read(folder / "heated.msh")
    cells = [block for block in drawn.cells if block.type == "hexahedron"]
    node = cKDTree(structure["points"]).query(drawn.points)[1]
    data = {"displacement": structure["displacement"][node], "package": structure["package"][node].astype(np.uint8)}
    meshio.Mesh(drawn.points, cells, point_data=data).write(folder / "structure.vtu")
