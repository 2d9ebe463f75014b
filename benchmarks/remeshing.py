"""Two hundred joints of known shapes, meshed or refused: method, errors, quality, tries and cost of each kind.

Run: PYTHONPATH=. .venv/bin/python benchmarks/remeshing.py           (about a minute; to benchmarks/results)
     PYTHONPATH=. .venv/bin/python benchmarks/remeshing.py --quick   (every eighth of each kind)
Seconds are those of this process; Gmsh makes tetrahedra in processes of its own, which are not counted.
"""

import argparse

from benchmarks.support import results
from tests.support.many_joints import COUNTS, outcome, samples

NAME = "remeshing"
WORST = ("volume_error", "standoff_error", "contact_area_error", "shape_deviation", "tries")


def summary(kind: str, found: list[dict]) -> dict:
    """The worst of one kind."""
    meshed = [one for one in found if one["method"] != "refused"]
    return {
        "kind": kind,
        "count": len(found),
        **{way: sum(one["method"] == way for one in found) for way in ("swept", "free-form", "refused")},
        **{name: max((one[name] for one in meshed), default=None) for name in WORST},
        "scaled_jacobian": min((one["scaled_jacobian"] for one in meshed), default=None),
        "smallest_length": min((one["smallest_length"] for one in meshed), default=None),
        "seconds": sum(one["seconds"] for one in found) / len(found),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    found = [outcome(sample) for sample in samples(8 if parser.parse_args().quick else 1)]
    table = [summary(kind, own) for kind in COUNTS if (own := [one for one in found if one["kind"] == kind])]
    for row in table:
        print(
            "  ".join(
                f"{name} {value:.3g}" if isinstance(value, float) else f"{name} {value}" for name, value in row.items()
            )
        )
    for one in found:
        if one["method"] == "refused":
            print(f"refused: {one['kind']}: {one['reason']}")
    results.write_figures(NAME, {"kinds": table, "joints": found})


if __name__ == "__main__":
    main()
