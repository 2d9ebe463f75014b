"""One joint between patches of board and substrate: what its measures lose where boxes ignore its pads.

    python benchmarks/imprinted_pads.py --out imprinted_pads.json [--halved]

The scene of ``tests/support/imprinted_patch.py`` in static equilibrium, elastic or with solder that yields (deformation
plasticity, which is what J2 gives under a load in proportion), by the program's own elements, meshes and ties.
"""

import argparse
import json
from pathlib import Path
from time import process_time

from reflowshock.fem.elements.element import critical_steps, element_geometry
from reflowshock.meshing.core.hexahedra import scaled_jacobian
from tests.support.imprinted_patch import IMPRINTED, MESHES, Mesh, Problem, ends, half_of, patch


def measured(mesh: Mesh) -> dict:
    """Return what a mesh is like, and its measures elastic and with solder that yields."""
    start = process_time()
    whole, joint = patch(mesh)
    own = whole.mesh
    counts = {name: int((own.part == number).sum()) for number, name in enumerate(own.part_names)}
    if mesh.joint["core"] % 2 == 0 and not mesh.shift:  # then y = 0 is a line of the mesh
        whole = half_of(whole)
        own = whole.mesh
    found = {
        "elements": counts,
        "scaled_jacobian": min(float(scaled_jacobian(joint.points, cells).min()) for cells in joint.cells.values()),
        "solder_volume_error": joint.volume_error,
        "contact_area_error": joint.record["contact_area_error"],
    }
    for name, yields in (("elastic", False), ("yielding", True)):
        problem = Problem(whole, yields)
        found[name] = dict(ends(problem, problem.solve()))
    steps = critical_steps(problem.elements, element_geometry(own.points, own.cells).nodal_volume)
    smallest = {name: float(steps[own.part == number].min()) for number, name in enumerate(own.part_names)}
    return found | {"critical_steps": smallest, "seconds": process_time() - start}


def main() -> None:
    """Compute all meshes and write their measures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--halved", action="store_true", help="also the imprinted mesh with every element halved")
    options = parser.parse_args()
    meshes = MESHES | ({"imprinted, halved": IMPRINTED.halved()} if options.halved else {})
    results = {name: measured(mesh) for name, mesh in meshes.items()}
    text = json.dumps(results, indent=1)
    print(text)
    if options.out:
        options.out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
