"""Drop shock: explicit dynamics on DOLFINx meshes, one model or two coupled ones."""

from reflowshock.kernel_cache import install_locator

install_locator()
