"""What is between board and package when the solder is liquid: a structure that bends, or rigid plates, and why."""

from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fem.thermal.parameters import Thermal
from workflow.board_drop_case import BoardDropCase
from workflow.reflow.load_steps import load_steps

if TYPE_CHECKING:
    from fem.thermal.state import Structure
    from meshing.pads import PadSite
    from particles.geometry import JointGeometry

Floats = NDArray[np.float64]

NEGLIGIBLE = 1e-4  # of the gap: what solder may change of it by bending plates before that is left out


def flexible_effect(thermal: Thermal) -> dict:
    """Decide whether board and package bend: where the temperature changes, or the user says so."""
    change = max(abs(step.temperature - thermal.reference) for step in load_steps(thermal))
    why = f"up to {change:.4g} K from the reference while the solder is liquid"
    why += ": board and package expand and bend" if change else ": nothing bends the plates, they are rigid"
    return by_switch(thermal.effects.flexible, change > 0.0, why)


def by_switch(switch: str, on: bool, why: str) -> dict:
    """Return a decision, the user's where he made one."""
    if switch == "auto":
        return {"on": on, "why": why}
    return {"on": switch == "on", "why": f"set to {switch} by the user ({why})"}


def solder_force_effect(
    thermal: Thermal, structure: "Structure", flexible: bool, geometries: "list[JointGeometry]", pull: Floats
) -> dict:
    """Decide whether the solder's forces bend the plates in turn: by what its pull changes of the gaps.

    Args:
        thermal: course of temperatures.
        structure: board and package.
        flexible: whether they bend at all.
        geometries: of the joints.
        pull: `(joints, 2, 6)` pi a gamma [N], and times the radius [N m].
    """
    if not flexible:
        return {"on": False, "why": "rigid plates do not bend"}
    wrenches = np.zeros_like(pull)
    wrenches[:, 0, 2], wrenches[:, 1, 2] = pull[:, 0, 2], -pull[:, 1, 2]
    still = np.zeros(len(structure.rigid_modes.names))
    lift = [structure.solve(thermal.peak, 0.0, own, still).pad_motion[:, :, 2] for own in (wrenches, 0.0 * wrenches)]
    change = np.abs(np.diff(lift[0] - lift[1], axis=1)).max()
    number = float(change / min(geometry.gap for geometry in geometries))
    why = f"pi a gamma on every pad changes the gaps by up to {number:.2g} of the smallest"
    return by_switch(thermal.effects.solder_force, number > NEGLIGIBLE, f"{why} (left out below {NEGLIGIBLE:g})")


def open_structure(
    case: BoardDropCase, thermal: Thermal, mesh: Path, pads: "list[PadSite]", flexible: bool
) -> "AbstractContextManager[Structure]":
    """Return board and package as a structure, in a process of its own where it bends; a context that ends it.

    Args:
        case: the case.
        thermal: its course of temperatures.
        mesh: board and package, flat.
        pads: as drawn.
        flexible: whether they bend.
    """
    from fem.thermal.process import StructureProcess

    from fem.thermal.pads import Pads
    from fem.thermal.state import Assembly

    if not flexible:
        return nullcontext(_rigid(case, thermal, mesh, pads))
    lower = np.array([(pad.x, pad.y, pad.z_board) for pad in pads])
    upper = lower + np.array([(*pad.offset, pad.gap) for pad in pads])
    radii = np.array([(pad.wetted_radius_board, pad.wetted_radius_package) for pad in pads])
    names = [pad.name for pad in pads]
    gravity = case.solder.gravity
    assembly = Assembly(mesh, Pads(names, np.stack((lower, upper), axis=1), radii), case.materials, thermal, gravity)
    return StructureProcess(assembly)


def _rigid(case: BoardDropCase, thermal: Thermal, mesh: Path, pads: "list[PadSite]") -> "Structure":
    """Rigid plates; a prescribed warpage is in the pads already."""
    from fem.mesh_file import read_mesh
    from fem.thermal.scene import package_nodes
    from meshing.pads import lift
    from workflow.reflow.rigid_plates import RigidPlates, free_modes, free_names, package_weight

    data = read_mesh(mesh)
    centres = np.array([(pad.x, pad.y, pad.z_board + pad.gap) for pad in pads])
    names = free_names(case.board.symmetry, thermal.package)
    raised = lift(case.package, case.warpage, data.points[:, 0], data.points[:, 1])
    modes = free_modes(names, centres, package_weight(case))
    return RigidPlates(data.points, package_nodes(data), raised, modes)
