"""Trials of each family of hard cases, and the small bodies, meshes and surfaces that they share."""
