"""The pipeline: case file, command line, stages, report."""

__version__ = "0.1.0"
