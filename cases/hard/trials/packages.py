"""Small package on a small board with variable fields."""

from reflowshock.meshing.board.package_side import PackageSide
from reflowshock.meshing.board.parameters import Board, Package, Warpage

MM = 1.0e-3
PLATE = {"thickness": 0.02 * MM, "layout": "plate"}


def package(**changes) -> Package:
    """Return a 4 x 4 array at 1 mm under a 5 mm package with a 3 mm die; fields as keywords."""
    values = {
        "rows": 4,
        "columns": 4,
        "pitch": 1.0 * MM,
        "standoff": 0.31 * MM,
        "board_pad": {"diameter": 0.48 * MM, "mask_opening": 0.58 * MM, "definition": "NSMD"},
        "package_pad": {"diameter": 0.58 * MM, "mask_opening": 0.48 * MM, "definition": "SMD"},
        "substrate": {"length": 5.0 * MM, "width": 5.0 * MM, "thickness": 0.4 * MM},
        "die": {"length": 3.0 * MM, "width": 3.0 * MM, "thickness": 0.4 * MM},
    }
    return Package.model_validate(values | changes)


def board(**changes) -> Board:
    """Return a board of 40 x 30 x 1 mm, quarter symmetry, 2 mm holes 3 mm from its edges; fields as keywords."""
    values = {
        "length": 40.0 * MM,
        "width": 30.0 * MM,
        "thickness": 1.0 * MM,
        "holes": {"diameter": 2.0 * MM, "inset_x": 3.0 * MM, "inset_y": 3.0 * MM},
    }
    return Board.model_validate(values | changes)


def aside(**changes) -> Board:
    """Return the whole board with an off-centre package and five holes, not in a rectangle; fields as keywords."""
    places = ((-8.0, -7.0), (14.0, -7.0), (-8.0, 10.0), (14.0, 10.0), (9.0, -7.0))
    holes = {"diameter": 2.0 * MM, "at": [(x * MM, y * MM) for x, y in places]}
    values = {"length": 30.0 * MM, "width": 24.0 * MM, "centre": (3.0 * MM, 1.5 * MM), "holes": holes}
    return board(**({"symmetry": "full"} | values | changes))


def side_of(warpage: Warpage, the_package: Package) -> PackageSide:
    """Return the underside of a package with a prescribed warpage."""
    return PackageSide.prescribed(the_package, board(symmetry="full"), warpage)
