"""Parametric studies: one case at many settings."""
