"""Sections of the report on a package: its joints, their meshes, the shock."""
