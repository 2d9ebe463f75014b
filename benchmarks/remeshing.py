"""Meshing of two hundred joints of known shape: method, errors, quality, attempts and cost of each kind.

Run: PYTHONPATH=. .venv/bin/python benchmarks/remeshing.py           (about a minute; to benchmarks/results)
     PYTHONPATH=. .venv/bin/python benchmarks/remeshing.py --quick   (every eighth of each kind)
Times are seconds of this process; the tetrahedra of Gmsh are made in separate processes, which are not counted.
"""

import argparse

from benchmarks.support import results
from tests.support.many_joints import COUNTS, outcome, samples

NAME = "remeshing"
WORST = ("volume_error", "standoff_error", "contact_area_error", "shape_deviation", "tries")


def summarise(kind: str, joints: list[dict]) -> dict:
    """Return counts and worst values of the joints of one kind.

    Args:
        kind: Name of the kind of shape.
        joints: Outcome of each joint: method, errors, quality and seconds.

    Returns:
        ``kind``, ``count``, numbers by method (``swept``, ``free-form``, ``refused``), largest error of each name in
        ``WORST``, smallest ``scaled_jacobian`` and ``smallest_length`` [m], and mean ``seconds``.
    """
    meshed = [joint for joint in joints if joint["method"] != "refused"]
    return {
        "kind": kind,
        "count": len(joints),
        **{way: sum(joint["method"] == way for joint in joints) for way in ("swept", "free-form", "refused")},
        **{name: max((joint[name] for joint in meshed), default=None) for name in WORST},
        "scaled_jacobian": min((joint["scaled_jacobian"] for joint in meshed), default=None),
        "smallest_length": min((joint["smallest_length"] for joint in meshed), default=None),
        "seconds": sum(joint["seconds"] for joint in joints) / len(joints),
    }


def main() -> None:
    """Mesh all joints, or every eighth; print and store the figures of each kind."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    joints = [outcome(sample) for sample in samples(8 if parser.parse_args().quick else 1)]
    table = [
        summarise(kind, joints_of_kind)
        for kind in COUNTS
        if (joints_of_kind := [joint for joint in joints if joint["kind"] == kind])
    ]
    for row in table:
        print(
            "  ".join(
                f"{name} {value:.3g}" if isinstance(value, float) else f"{name} {value}" for name, value in row.items()
            )
        )
    for joint in joints:
        if joint["method"] == "refused":
            print(f"refused: {joint['kind']}: {joint['reason']}")
    results.write_figures(NAME, {"kinds": table, "joints": joints})


if __name__ == "__main__":
    main()
