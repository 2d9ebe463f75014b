"""Convergence of one joint between patches of board and substrate on the program's own meshes.

    PYTHONPATH=. python benchmarks/imprinted_pads.py [TABLE ...]  (one core; writes results/imprinted_pads.json)

The scene of ``tests/support/imprinted_patch.py`` in static equilibrium, elastic or with plastic solder (deformation
plasticity, equal to J2 flow under proportional load), with the program's own elements, meshes and ties. Tables:
``meshes``  ties to boxes that ignore the pads; columns; columns with boxes shifted by half an element; free-form
``halved``  element sizes of 1, 2/3 and 1/2 of the imprinted mesh, elastic and yielding
``turned``  the motion rotated against the mesh
"""

import os
from math import hypot, radians
from time import process_time

os.environ.setdefault("OMP_NUM_THREADS", "1")

from benchmarks.support.tables import write_tables
from reflowshock.fem.elements.element import critical_steps, element_geometry
from reflowshock.meshing.core.hexahedra import scaled_jacobian
from reflowshock.workflow.convergence.errors import richardson
from tests.support.imprinted_patch import IMPRINTED, LAYER, MESHES, PADS, Mesh, Problem, ends, half_of, patch

NAME = "imprinted_pads"
LAYERS = (0.5 * LAYER, LAYER, 2.0 * LAYER)
SIZES = (1.0, 2.0 / 3.0, 0.5)
ANGLES = (0.0, 30.0, 45.0)
PRINTED = ("axial_force", "shear_force", "bending_moment", "von_mises:25um", "plastic_work:25um")
Measures = dict[str, float]


def solve_patch(mesh: Mesh, yields: bool, angle: float | None = None) -> Measures:
    """Solve a joint between patches of board and substrate whose sides move.

    Args:
        mesh: Settings of the mesh.
        yields: Whether the solder is plastic.
        angle: Direction of the motion in plan [rad]; None for the motion along x.

    Returns:
        Section forces [N, N m] and averages at both ends of the joint, named ``<measure>@<end>``.
    """
    whole, _ = patch(mesh)
    if angle is None and mesh.joint["core"] % 2 == 0 and not mesh.shift and mesh.swept:  # y = 0 is a line of the mesh
        whole = half_of(whole)
    problem = Problem(whole, yields, turned=angle)
    measures = ends(problem, problem.solve(), LAYERS)
    return {f"{name}@{end}": value for end, values in measures for name, value in values.items()}


def describe_mesh(mesh: Mesh) -> dict:
    """Return sizes, quality and critical steps of the mesh of a joint between patches.

    Args:
        mesh: Settings of the mesh.

    Returns:
        ``elements`` by part, smallest ``scaled_jacobian``, relative ``solder_volume_error`` and ``contact_area_error``,
        and ``critical_steps`` by part [s].
    """
    whole, joint = patch(mesh)
    data, elements = whole.mesh, Problem(whole, False).elements
    steps = critical_steps(elements, element_geometry(data.points, data.cells).nodal_volume)
    parts = {name: data.part == number for number, name in enumerate(data.part_names)}
    return {
        "elements": {name: int(cells.sum()) for name, cells in parts.items()},
        "scaled_jacobian": min(float(scaled_jacobian(joint.points, cells).min()) for cells in joint.cells.values()),
        "solder_volume_error": joint.volume_error,
        "contact_area_error": joint.record["contact_area_error"],
        "critical_steps": {name: float(steps[cells].min()) for name, cells in parts.items()},
    }


def compare_meshes() -> dict:
    """Return the name of each mesh -> figures of ``describe_mesh``, and measures ``elastic`` and ``yielding``."""
    return {
        name: describe_mesh(mesh) | {"elastic": solve_patch(mesh, False), "yielding": solve_patch(mesh, True)}
        for name, mesh in MESHES.items()
    }


def compare_sizes() -> dict:
    """Solve the elastic and the yielding joint on three meshes.

    Moments are relative to the section force times the pad radius.

    Returns:
        ``elastic`` and ``yielding`` -> measures by element size, relative ``changes`` between sizes, and ``limits``:
        Richardson's limit and order of each measure.
    """
    result = {}
    for name, yields in (("elastic", False), ("yielding", True)):
        rows = {f"{size:.3g}": _timed(size, yields) for size in SIZES}
        values = [row["values"] for row in rows.values()]
        limits = {key: richardson(SIZES, [row[key] for row in values], None) for key in values[0]}
        result[name] = rows | {
            "changes": [_changes(coarse, fine) for coarse, fine in ((values[0], values[1]), (values[0], values[2]))],
            "limits": {key: {"value": limit[0], "order": limit[1]} for key, limit in limits.items() if limit},
        }
        for differences in result[name]["changes"]:
            print(
                f"{name:9} "
                + "  ".join(f"{key} {differences[key]:+.1%}" for key in differences if key.split("@")[0] in PRINTED)
            )
    return result


def compare_rotations() -> dict:
    """Solve the elastic joint under motions in several directions.

    Returns:
        ``values``, angle in degrees -> measures, and ``changes``, their relative differences to the motion along x.
    """
    rows = {f"{angle:g}": solve_patch(IMPRINTED, False, radians(angle)) for angle in ANGLES}
    first = next(iter(rows.values()))
    changes = {angle: _changes(row, first) for angle, row in rows.items()}
    for angle, differences in changes.items():
        print(
            f"{angle:>3} deg "
            + "  ".join(f"{key} {differences[key]:+.2%}" for key in differences if key.split("@")[0] in PRINTED)
        )
    return {"values": rows, "changes": changes}


def _timed(size: float, yields: bool) -> dict:
    begin = process_time()
    values = solve_patch(IMPRINTED.times(size), yields)
    return {"seconds": process_time() - begin, "values": values}


def _changes(coarse: Measures, fine: Measures) -> Measures:
    """Return the relative differences between a coarse and a fine mesh; moments over force times radius."""
    radius = 0.5 * PADS["diameter"]
    scale = {end: hypot(fine[f"axial_force@{end}"], fine[f"shear_force@{end}"]) for end in ("board", "package")}
    over = fine | {f"bending_moment@{end}": radius * force for end, force in scale.items()}
    return {key: (coarse[key] - value) / over[key] for key, value in fine.items() if over[key]}


TABLES = {"meshes": compare_meshes, "halved": compare_sizes, "turned": compare_rotations}


if __name__ == "__main__":
    write_tables(__doc__.splitlines()[0], TABLES, NAME)
