"""The scheme ispg in a plane: bodies of revolution by their meridian, and drops that are the same along y."""
