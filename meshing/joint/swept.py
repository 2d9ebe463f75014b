"""Swept solder: butterfly sections of a body, stacked from the board's pad to the package's."""

from reflowshock.meshing.board.parameters import JointNumerics
from reflowshock.meshing.joint.butterfly import butterfly
from reflowshock.meshing.joint.levels import Placing, layer_cells, solder_levels
from reflowshock.meshing.joint.solder import Solder, WettedFace
from reflowshock.meshing.surface.closed_surface import ClosedSurface, pad_planes


def swept_solder(surface: ClosedSurface, numerics: JointNumerics, place: Placing, overhang: float = 0.0) -> Solder:
    """Sweep hexahedra through a body; arguments and errors as ``solder_levels``."""
    section = butterfly(numerics.core, numerics.rings)
    levels = solder_levels(surface, section, numerics.layers, place, overhang)
    count = len(section.points)
    top = numerics.layers * count
    faces = (
        WettedFace("board", section.quads, section.rim),
        WettedFace("package", section.quads + top, section.rim + top),
    )
    cells = layer_cells(section.quads, count, numerics.layers)
    return Solder(levels.points.reshape(-1, 3), cells, faces, levels.volume, levels.scale, pad_planes(surface))
