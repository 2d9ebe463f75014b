import matplotlib.image
import numpy as np
import pytest

from reflowshock.cases.hard.trials.packages import board, package
from reflowshock.meshing.board.assembly import write_assembly
from reflowshock.meshing.core.preview import COLOURS, colour, write_preview


@pytest.mark.parametrize(
    ("part", "role"),
    [("board", "board"), ("board_patch", "board_patch"), ("copper_board@A4", "copper"), ("solder@B3", "solder")],
)
def test_parts_have_the_colour_of_their_role(part, role):
    assert colour(part) == COLOURS[role]


def test_picture_shows_green_board_and_golden_substrate(tmp_path):
    write_assembly(package(), board(), tmp_path / "assembly.msh")
    write_preview([tmp_path / "assembly.msh"], tmp_path / "preview.png")
    red, green, blue = np.moveaxis(matplotlib.image.imread(tmp_path / "preview.png")[:, :, :3], 2, 0)
    assert np.mean((green > 1.3 * red) & (green > 1.3 * blue)) > 0.1  # share of the picture
    assert np.mean((red > 2.0 * blue) & (red > green)) > 0.02
