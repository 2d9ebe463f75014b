"""The assembly that is heated has the shock's package, and its grid on the board below."""

import meshio
import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import MM, PLATE, board, package
from reflowshock.meshing.board.assembly import write_assembly, write_heated_assembly


@pytest.mark.parametrize("copper", [{}, PLATE])
def test_nodes_of_package_and_pads_are_the_shocks(tmp_path, copper):
    parts = package(copper=copper) if copper else package()
    fine = {"element_size": 0.5 * MM, "coarse_size": 1.0 * MM, "layers": 4}
    plate = board(numerics=fine)
    counts = write_assembly(parts, plate, tmp_path / "assembly.msh")
    heated = write_heated_assembly(parts, plate, tmp_path / "heated.msh")
    assert heated.keys() == counts.keys()
    assert heated["substrate"] == counts["substrate"]
    assert sum(heated.values()) < 0.5 * sum(counts.values())
    shared = [above_board(tmp_path / name) for name in ("assembly.msh", "heated.msh")]
    assert shared[0] == pytest.approx(shared[1], abs=1e-12)


def above_board(path) -> np.ndarray:
    """Nodes of the package, and of the board's top below it, in order."""
    points = meshio.read(path).points
    below = (np.abs(points[:, :2]) <= 2.5 * MM + 1e-9).all(axis=1)
    chosen = np.round(points[below & (points[:, 2] > -1e-9)] / 1e-9)
    return 1e-9 * np.unique(chosen, axis=0)
