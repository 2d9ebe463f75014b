"""Cost table: core time, ranks, elements and steps of the two-scale run and the DNS, with published values."""

from collections.abc import Callable, Mapping
from typing import Any

from reflowshock.workflow.case.text import nano, number, quantity
from reflowshock.workflow.report.tables import mode_name

Record = Mapping[str, Any]

PAPER = "Hu et al., Table 6 and section 4.4: 10 x 10 package, Intel Xeon Silver 4116"
PUBLISHED = {
    "dns": {
        "core time / DNS": "1.0",
        "simulated time": "1.5 ms",
        "wall time of windows": "137 min",
        "ranks": "24 cores",
        "hexahedra": "155 878",
    },
    "two_scale": {
        "core time / DNS": "0.285",
        "simulated time": "1.5 ms",
        "wall time of windows": "39 min",
        "ranks": "8 cores macro + 16 cores meso",
        "hexahedra": "116 664 macro + 39 214 meso",
    },
}
ROWS: tuple[tuple[str, Callable[[Record], str]], ...] = (
    ("simulated time", lambda result: f"{1e3 * result['model']['window'] * result['model']['windows']:.3g} ms"),
    ("wall time of windows", lambda result: duration(result["timings"]["windows"])),
    ("ranks", lambda result: ranks(result)),
    ("hexahedra", lambda result: by_role(result["model"]["elements"])),
    ("time step", lambda result: steps(result)),
    ("steps", lambda result: counts(result["model"])),
    ("memory", lambda result: memory(result)),
)


def duration(seconds: float) -> str:
    """Return a time in seconds or minutes, as text."""
    return f"{seconds:.1f} s" if seconds < 120.0 else f"{seconds / 60.0:.1f} min"


def by_role(counts_of: Mapping[str, int]) -> str:
    """Return counts of each model as text, such as "120 macro + 80 meso".

    Args:
        counts_of: Role of the model ("macro", "meso") -> count. For a single role the count is written alone.
    """
    if len(counts_of) == 1:
        return number(next(iter(counts_of.values())))
    return " + ".join(f"{number(count)} {role}" for role, count in counts_of.items())


def ranks(result: Record) -> str:
    """Return the number of ranks and their placement on the models, as text.

    Args:
        result: Content of ``result.json`` of a mode, with ``model`` (``mode``, ``ranks``) and, if coupled,
            ``coupling``.
    """
    count = f"{result['model']['ranks']} {'rank' if result['model']['ranks'] == 1 else 'ranks'}"
    chosen = result.get("coupling", {}).get("placement", {}).get("chosen", "")
    return count if result["model"]["mode"] == "dns" or not chosen else f"{count}: {chosen}"


def steps(result: Record) -> str:
    """Return the time step of a DNS (one model), or of all levels of a two-scale run, the window first, as text.

    A window is the time between two exchanges of both models.

    Args:
        result: Content of ``result.json`` of a mode, with ``model`` (``mode``, ``step``, ``window`` [s]) and
            ``coupling``.
    """
    model = result["model"]
    levels = result.get("coupling", {}).get("levels", ())
    if model["mode"] == "dns":
        return nano(model["step"])
    return ", ".join(nano(level["step"]) for level in levels) or f"{nano(model['window'])}, {nano(model['step'])}"


def counts(model: Record) -> str:
    """Return the number of steps of a DNS, or of the macro model and the finest level of a two-scale run, as text.

    Args:
        model: Entry ``model`` of a ``result.json``, with ``mode``, ``windows`` (times between two exchanges) and
            ``substeps`` (steps in each).
    """
    every = number(model["windows"] * model["substeps"])
    return every if model["mode"] == "dns" else f"{number(model['windows'])}, {every}"


def memory(result: Record) -> str:
    """Return the peak memory of all ranks together, as text; empty if it was not measured.

    Args:
        result: Content of ``result.json`` of a mode, with ``metrics``.
    """
    peak = result["metrics"].get("peak_memory")
    return quantity(peak) if peak else ""


def table(results: Mapping[str, dict], metrics: Record) -> dict | None:
    """Return the cost table of DNS (one model), two-scale run and the published ones; None unless both modes were run.

    Args:
        results: Mode -> content of its ``result.json`` (``model``, ``metrics``, ``health``, ``timings``, ``coupling``).
        metrics: Name -> record with ``value`` (SI) and ``unit``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): columns for DNS, two-scale run and both
        published runs; None unless both modes were run.
    """
    if "two_scale_dns_core_ratio" not in metrics:
        return None
    ratios = {"dns": "1", "two_scale": f"{metrics['two_scale_dns_core_ratio']['value']:.3f}"}
    ours = {mode: {"core time / DNS": ratios[mode]} | _cells(results[mode]) for mode in ("dns", "two_scale")}
    labels = dict.fromkeys(label for cells in ours.values() for label, text in cells.items() if text)
    columns = [*ours.values(), *PUBLISHED.values()]
    rows = [[label, *(cells.get(label, "") or "–" for cells in columns)] for label in labels]
    heads = [mode_name(mode) for mode in ours]
    return {"head": ["", *heads, "published: DNS", "published: two-scale"], "rows": rows}


def _cells(result: Record) -> dict[str, str]:
    return {label: text(result) for label, text in ROWS}
