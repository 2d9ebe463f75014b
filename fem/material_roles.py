"""The material of each role that a part of a package can have."""

from fem.material_library import COPPER, FR4, SAC405, SILICON
from fem.material_parameters import Material
from fem.parameters import Parameters


class Materials(Parameters):
    """The material of each role that a part of the mesh can have."""

    board: Material = FR4
    substrate: Material = FR4
    die: Material = SILICON
    copper: Material = COPPER
    solder: Material = SAC405
