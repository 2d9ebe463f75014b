"""Stages of a case: what each reads and writes. Snakemake's rules and the reasons that `plan` gives come from here."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    pass

PAGE = ("report.html", "summary.json")


@dataclass(frozen=True, slots=True)
class Stage:
    """One stage of the pipeline.

    Attributes:
        name: name of the stage and of its folder.
        parameters: dotted keys of the parameters, or tables of them, that it depends on.
        follows: stages whose products it depends on: when they ran, it has to run.
        pads: whether it reads the pad table as drawn. Its ``parameters`` then contain all that this table depends on,
            so that it need not run again when the geometry changes elsewhere.
        products: files that it writes, relative to the run folder.
        on_top: those of its files that a run folder also shows at its top.
        without: those of its parameters, or tables of them, that it does not depend on.
    """

    name: str
    parameters: tuple[str, ...]
    follows: tuple[str, ...]
    products: tuple[str, ...]
    pads: bool = False
    on_top: tuple[str, ...] = ()
    without: tuple[str, ...] = ()

    def depends_on(self, key: str) -> bool:
        """Whether it depends on a parameter."""
        return _stands_in(key, self.parameters) and not _stands_in(key, self.without)

    @property
    def record(self) -> str:
        """File, relative to the run folder, in which the stage says what it used, found and measured."""
        return f"{self.name}/stage.json"


def _stands_in(key: str, tables: tuple[str, ...]) -> bool:
    return any(key == table or key.startswith(table + ".") for table in tables)


@dataclass(frozen=True, slots=True)
class Pipeline:
    """The stages of a kind of case, in order."""

    stages: tuple[Stage, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the stages."""
        return tuple(stage.name for stage in self.stages)

    def __getitem__(self, name: str) -> Stage:
        return self.stages[self.names.index(name)]

    def upstream(self, name: str) -> tuple[Stage, ...]:
        """Return the stages up to and including one."""
        return self.stages[: self.names.index(name) + 1]

    def read_by(self, name: str) -> tuple[str, ...]:
        """Return the names of the stages whose products one reads: that it follows, and that those follow, in order."""
        if self[name].pads:
            return ("geometry",)
        found = set(self[name].follows)
        for stage in reversed(self.upstream(name)[:-1]):
            found |= set(stage.follows) if stage.name in found else set()
        return tuple(one for one in self.names if one in found)


def report_of(*follows: str, parameters: tuple[str, ...] = ()) -> Stage:
    """Return the last stage of a pipeline, which tells what the others found; ``parameters`` are what it judges by."""
    pages = tuple(f"report/{name}" for name in PAGE)
    return Stage("report", ("case", "scale", *parameters), follows, pages, on_top=PAGE)
