"""Files of a printed part: surface, height map and table of layers."""

from pathlib import Path

import meshio
import numpy as np

from reflowshock.particles.printing.part import Part

LAYERS = "layer,drops,parts_of_layer,parts_so_far,mean_top_um,height_um,roughness_sa_um,roughness_sz_um,volume_pl,voids"
# Factors from SI units to the units of the columns.
FACTORS = np.array([1.0, 1.0, 1.0, 1.0, 1e6, 1e6, 1e6, 1e6, 1e15, 1.0])


def write_part(folder: Path, part: Part) -> None:
    """Write ``part.stl`` [mm], ``height_map.npy`` [m], ``height_map.csv`` [um] and ``layers.csv`` [um, pL].

    The first row of ``height_map.csv`` has y, its first column x; ``height_map.npy`` has one row for each x.

    Args:
        folder: Folder of the files.
        part: Printed part.
    """
    meshio.Mesh(1e3 * part.points, [("triangle", part.triangles)]).write(folder / "part.stl", file_format="stl")
    np.save(folder / "height_map.npy", part.heights)
    table = np.zeros((len(part.x) + 1, len(part.y) + 1))
    table[1:, 0], table[0, 1:], table[1:, 1:] = 1e6 * part.x, 1e6 * part.y, 1e6 * part.heights
    np.savetxt(folder / "height_map.csv", table, fmt="%.3f", delimiter=",", header="um: x down, y across")
    rows, formats = np.array(part.layers) * FACTORS, ["%d"] * 4 + ["%.3f"] * 5 + ["%d"]
    np.savetxt(folder / "layers.csv", rows, fmt=formats, delimiter=",", header=LAYERS, comments="")
