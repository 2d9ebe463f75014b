"""Materials: parameters, library with sources, elasticity, material of each role."""
