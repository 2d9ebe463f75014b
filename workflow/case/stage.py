"""Stages and pipelines of cases: parameters, inputs and products, from which jobs and stale products are derived."""

from dataclasses import dataclass

PAGE = ("report.html", "summary.json")
ERROR_METHOD = "numerics.error.method"


@dataclass(frozen=True, slots=True)
class Stage:
    """One stage of the pipeline.

    Attributes:
        name: Name of the stage and of its folder.
        parameters: Dotted keys of parameters or tables that the stage depends on.
        follows: Stages whose products it reads.
        pads: Whether it reads only the pad table of the geometry. Its ``parameters`` then include the inputs of this
            table, so that other changes of the geometry do not make it stale.
        products: Files that it writes, relative to the run folder.
        on_top: Files that also appear at the top of the run folder.
        without: Dotted keys within ``parameters`` that it does not depend on.
    """

    name: str
    parameters: tuple[str, ...]
    follows: tuple[str, ...]
    products: tuple[str, ...]
    pads: bool = False
    on_top: tuple[str, ...] = ()
    without: tuple[str, ...] = ()

    def depends_on(self, key: str) -> bool:
        """Return whether the stage depends on a parameter."""
        return _stands_in(key, self.parameters) and not _stands_in(key, self.without)

    @property
    def record(self) -> str:
        """Path of the stage's record, relative to the run folder."""
        return f"{self.name}/stage.json"


def _stands_in(key: str, tables: tuple[str, ...]) -> bool:
    return any(key == table or key.startswith(table + ".") for table in tables)


@dataclass(frozen=True, slots=True)
class Pipeline:
    """Stages of a kind of case, in order."""

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
        """Return the names of all direct and indirect upstream stages of a stage, in order."""
        if self[name].pads:
            return ("geometry",)
        upstream = set(self[name].follows)
        for stage in reversed(self.upstream(name)[:-1]):
            upstream |= set(stage.follows) if stage.name in upstream else set()
        return tuple(stage_name for stage_name in self.names if stage_name in upstream)


SHOCK = "shock"  # stage of the time steps of a drop or a structure
# Errors of the shock, estimated from companions on coarser meshes: workflow/convergence/error_estimate.py
ERRORS = Stage("errors", (ERROR_METHOD,), (SHOCK,), ("errors/errors.json",))


def report_of(*follows: str, parameters: tuple[str, ...] = ()) -> Stage:
    """Return the stage of a pipeline that writes ``report.html`` and ``summary.json``.

    Args:
        follows: Names of the stages whose products it reads.
        parameters: Dotted keys that its verdicts depend on.
    """
    pages = tuple(f"report/{name}" for name in PAGE)
    return Stage("report", ("case", "scale", *parameters), follows, pages, on_top=PAGE)
