"""A quarter model of a heated package against the full model: pad motions, also with copper plates."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from reflowshock.cases.hard.trials.packages import MM, PLATE, board, package
from reflowshock.fem.problem.thermal import Thermal
from reflowshock.fem.statics.pads import Pads
from reflowshock.fem.statics.state import Assembly, HeatedState
from reflowshock.fem.statics.structure import ThermalStructure
from reflowshock.materials.roles import ELASTIC
from reflowshock.meshing.board.assembly import write_heated_assembly
from reflowshock.meshing.board.pads import pad_table
from reflowshock.meshing.board.parameters import Warpage

MOVED = Thermal(package="moved", corner_displacement=-5e-5)


def solved(folder: Path, symmetry: str, copper: dict, thermal: Thermal) -> tuple[Pads, HeatedState]:
    """Return pads and their motion under heat, weight and joint forces towards the centre of the array."""
    parts = package(copper=copper)
    plate = board(symmetry=symmetry, numerics={"element_size": 0.5 * MM, "coarse_size": 4.0 * MM, "growth": 2.0})
    write_heated_assembly(parts, plate, folder / "heated.msh")
    sites = pad_table(parts, plate, Warpage())
    lower = np.array([(site.x, site.y, site.z_board) for site in sites])
    centres = np.stack([lower, lower + [0.0, 0.0, parts.standoff]], axis=1)
    pads = Pads([site.name for site in sites], centres, np.full((len(sites), 2), 0.24 * MM))
    structure = ThermalStructure.build(MPI.COMM_SELF, Assembly(folder / "heated.msh", pads, ELASTIC, thermal, 9.81))
    wrenches = np.zeros((len(sites), 2, 6))
    wrenches[:, 1, :3], wrenches[:, 0, :3] = -lower - [0.0, 0.0, 1e-3], lower + [0.0, 0.0, 1e-3]
    return pads, structure.solve(473.15, -5e-5, wrenches, np.zeros(len(structure.rigid_modes.names)))


@pytest.mark.long
@pytest.mark.parametrize(
    ("copper", "thermal"),
    [({}, Thermal()), (PLATE, MOVED)],
    ids=["floating", "moved, plates"],
)
def test_quarter_model_equals_full_model(tmp_path, copper, thermal):
    pads, quarter = solved(tmp_path, "quarter", copper, thermal)
    all_pads, whole = solved(tmp_path, "full", copper, thermal)
    number = [list(all_pads.names).index(name) for name in pads.names]
    assert len(all_pads.names) == 4 * len(pads.names)
    assert quarter.pad_motion == pytest.approx(whole.pad_motion[number], abs=1e-7 * np.abs(whole.pad_motion).max())
    mirrored = whole.pad_motion[::-1] * [-1.0, -1.0, 1.0, -1.0, -1.0, 1.0]  # half a turn, which reverses the pad table
    assert mirrored == pytest.approx(whole.pad_motion, abs=1e-9 * np.abs(whole.pad_motion).max())
    assert quarter.corner_force == pytest.approx(whole.corner_force[:1], rel=1e-6)
