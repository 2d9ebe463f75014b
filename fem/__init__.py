"""Drop shock: explicit dynamics on DOLFINx meshes, one model or two coupled ones."""

from reflowshock.kernel_place import ask_first

ask_first()
