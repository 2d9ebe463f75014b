"""Drop shock: explicit dynamics on DOLFINx meshes, one model or two coupled ones."""
