"""Base class of all kinds of case."""

from pathlib import Path
from typing import ClassVar, Self

from reflowshock.parameters import Parameters
from reflowshock.workflow.case.error_settings import Method
from reflowshock.workflow.case.names import Name
from reflowshock.workflow.case.stage import Pipeline

CASES = Path(__file__).resolve().parents[2] / "cases"  # shipped cases
FULL = "full"  # scale of a case without changes of its file


class Title(Parameters):
    """Name and title of a case; the run folder has the same name."""

    name: Name
    title: str = ""


class Case(Parameters):
    """Everything that a run depends on, in SI floats.

    Attributes:
        kind: Name of the table that identifies a case file of this kind.
        stages: Pipeline of all cases of this kind.
        ranks_key: Dotted key of ``ranks``.
        case: Name and title.
        scale: "full", or the name of a table in ``[scales]`` whose values replace values of the file.
    """

    kind: ClassVar[str]
    stages: ClassVar[Pipeline]
    ranks_key: ClassVar[str] = ""

    case: Title
    scale: Name = FULL

    @property
    def run_name(self) -> str:
        """Default name of the run folder."""
        return self.case.name if self.scale == FULL else f"{self.case.name}-{self.scale}"

    @property
    def pipeline(self) -> Pipeline:
        """Pipeline of this case."""
        return self.stages

    @property
    def error_method(self) -> Method:
        """Origin of the discretisation errors of a run."""
        return "measured"

    @property
    def ranks(self) -> int:
        """Number of MPI ranks of the package fem, the largest one if the run decides."""
        return 1

    @property
    def least_ranks(self) -> int:
        """Smallest number of MPI ranks; less than ``ranks`` if the run decides by idle cores."""
        return self.ranks

    @property
    def ranks_by_key(self) -> dict[str, int]:
        """Least numbers of MPI ranks of the stages, by dotted key."""
        return {self.ranks_key: self.least_ranks} if self.ranks_key else {}

    @classmethod
    def completed(cls, table: dict) -> dict:
        """Return the table of a case file with defaults that depend on the tables present."""
        return table

    def resolved(self) -> Self:
        """Return the case with all ``auto`` values resolved."""
        return self

    @classmethod
    def located(cls, table: dict, folder: Path) -> dict:
        """Resolve file names in a table of SI values relative to the folder of the case file."""
        return table

    @property
    def pulse_tables(self) -> dict[str, tuple[Path, str, str | None]]:
        """Pulse tables of the case by key: path, quantity, and column title (None for single columns)."""
        return {}

    @property
    def files(self) -> dict[str, Path]:
        """Input files of the case by key; their contents count as parameters."""
        return {}
