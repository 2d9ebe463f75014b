"""Environment of a computation: terminal, launched programs, resource limits, error exit.

Start with ``launch.py`` for MPI runs and ``error_exit.py`` for how a command ends.
"""
