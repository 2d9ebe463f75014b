"""Base class of all kinds of case."""

from pathlib import Path
from typing import ClassVar, Self

from reflowshock.parameters import Parameters
from reflowshock.workflow.case.names import Name
from reflowshock.workflow.case.stage import Pipeline

CASES = Path(__file__).resolve().parents[2] / "cases"  # those that the program ships
FULL = "full"  # the scale of a case as its file says it


class Title(Parameters):
    """Name and title of a case; the name is also that of its run folder."""

    name: Name
    title: str = ""


class Case(Parameters):
    """Everything that a run depends on, in SI floats.

    Attributes:
        kind: the table that makes a file a case of this kind.
        stages: of all cases of this kind.
        ranks_key: key of `ranks`.
        case: its name.
        scale: "full", or the name of the table of ``[scales]`` whose values replace those of the file.
    """

    kind: ClassVar[str]
    stages: ClassVar[Pipeline]
    ranks_key: ClassVar[str] = ""

    case: Title
    scale: Name = FULL

    @property
    def run_name(self) -> str:
        """Name of its run folder, where none is given."""
        return self.case.name if self.scale == FULL else f"{self.case.name}-{self.scale}"

    @property
    def pipeline(self) -> Pipeline:
        """The stages of this case."""
        return self.stages

    @property
    def ranks(self) -> int:
        """MPI ranks of the package fem."""
        return 1

    @property
    def ranks_by_key(self) -> dict[str, int]:
        """MPI ranks that it asks for, one stage after the other, by the key that does."""
        return {self.ranks_key: self.ranks} if self.ranks_key else {}

    @classmethod
    def completed(cls, table: dict) -> dict:
        """Return the table of a case file with the defaults that depend on which tables it has."""
        return table

    def resolved(self) -> Self:
        """Return the case with all ``auto`` values resolved."""
        return self

    @classmethod
    def located(cls, table: dict, folder: Path) -> dict:
        """Take names of files in a table of SI values as relative to the folder of the case file."""
        return table

    @property
    def pulse_tables(self) -> dict[str, tuple[Path, str, str | None]]:
        """Those of its files that are tables of a pulse, by key, which quantity each has, and in which column."""
        return {}

    @property
    def files(self) -> dict[str, Path]:
        """Files that its parameters name, by key: what they hold counts as a parameter, too."""
        return {}
