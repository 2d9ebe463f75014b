"""Errors of the shock stage. Input errors are ``ValueError``; a run that goes wrong is a ``RuntimeError``."""


class MeshError(ValueError):
    """A mesh file, a part or a facet set that the program cannot use."""


class TieError(ValueError):
    """A joint node that has no facet to be tied to."""


class CouplingError(ValueError):
    """An interface between macro and meso model that does not fit or is not stable."""


class LevelError(ValueError):
    """Step levels that do not go with the model."""


class RankError(ValueError):
    """A number of MPI ranks that does not fit the input."""


class MassError(ValueError):
    """Lumped masses that do not add up to density times volume."""


class PulseError(ValueError):
    """A tabulated pulse that cannot be read."""


class LoadError(ValueError):
    """A load or support that acts on nothing, or that does not go with another one."""


class EnergyError(RuntimeError):
    """A run whose energies do not balance, or are not numbers."""


class AgreedError(RuntimeError):
    """An error of one rank, raised on all ranks of the run."""


class StepError(AgreedError):
    """A time step above the critical one, which all ranks know."""


class CheckpointError(RuntimeError):
    """Checkpoint files that lack a part of the model."""


class ModesError(RuntimeError):
    """Incompatible modes of an element that find no equilibrium."""


class InvertedElementError(RuntimeError):
    """An element that the motion has turned inside out."""
