"""The flat assembly that is heated: its board is fine only where pads lie on it.

The shock's board may have a hundred thousand elements, for waves; what a reflow asks of it is how its pads move. Two
layers of the program's hexahedra and coarse cells away from the package give the gaps of hu_bga_drop's board (0.5 mm
everywhere, six layers) to a tenth of a nanometre, with a twentieth of the equations and 59 MB of factor, not 2.8 GB.
"""

from pathlib import Path

from reflowshock.meshing.board.assembly import write_assembly
from reflowshock.meshing.board.parameters import Board, Package

COARSE = 2.0  # thicknesses of the board


def write_heated_assembly(package: Package, board: Board, path: Path) -> dict[str, int]:
    """Mesh board and package for a reflow; package, and grid of the board below it, are those of ``write_assembly``."""
    coarse = max(board.numerics.coarse_size, COARSE * board.thickness)
    numerics = board.numerics.model_copy(update={"layers": 2, "patch_layers": 1, "coarse_size": coarse})
    return write_assembly(package, board.model_copy(update={"numerics": numerics}), path)
