"""Solder reflow and drop shock of BGA packages, from a case file to a report.

    import reflowshock

    case = reflowshock.Case.load("cases/bga_drop/case.toml", {"shock.peak_acceleration": "1000 G"})
    print(case.plan())
    run = case.run("runs/first")  # or, later: reflowshock.Run.open("runs/first")
    run.metrics["peel_stress"], run.joints, run.history["two_scale"]["time"], run.surface("A10")

The import loads no numerical library; each attribute loads its own. The packages in this folder are links to the
folders at the top of the checkout.
"""

from typing import TYPE_CHECKING, Any

from reflowshock.workflow import __version__

if TYPE_CHECKING:
    from reflowshock.api import Case, CaseError, Run, RunFailed, UnknownName

__all__ = ["Case", "CaseError", "Run", "RunFailed", "UnknownName", "__version__"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from reflowshock import api

        return getattr(api, name)
    raise AttributeError(f"module 'reflowshock' has no attribute {name!r}")
