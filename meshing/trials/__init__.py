"""Joints of exactly known shape, and what is measured of their meshes: for stress tests and tests."""
