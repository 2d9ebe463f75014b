"""Report section "Two scales": coupling of the models, step levels, placement, cost of an implicit run."""

from collections.abc import Mapping, Sequence
from typing import Any

from reflowshock.workflow.case.text import nano, number, quantity, short

Record = Mapping[str, Any]

SCHEMES = {
    "held_velocity": "held velocity, coupling interface inside the board",
    "local_steps": "local time steps (LTS-leapfrog)",
    "impulse": "impulses at a coupling interface inside the board",
    "gravouil_combescure": "Gravouil-Combescure, interface at the joints",
}
DIRECTIONS = {"two_way": "two-way", "one_way": "one-way: no feedback to the macro model"}
SELF_CHECK = {
    "rigid": "rigid motion through tie and interface, error",
    "linear": "linear field through tie and interface, error",
    "tie": "net force and moment lost at the tie",
    "interface": "net force and moment lost at the interface",
    "macro_mass": "mass of the macro model",
    "interface_mass": "mass of the meso model at the interface",
    "meso_mass": "mass of the rest of the meso model",
    "volume_mass": "density times volume, including mass scaling",
}


def two_scales(coupling: Record, model: Record, found_by: str = "") -> dict:
    """Return the table of the coupling of a two-scale run.

    Args:
        coupling: Entry ``coupling`` of its ``result.json``; entries that are missing are left out.
        model: Entry ``model`` of its ``result.json``, with ``window`` [s] and ``substeps``.
        found_by: How a coarse run selected the fine joints; empty without one.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text) of name and value: scheme with its reason,
        direction, fine joints or layers, window, step ratio, meso share, interface nodes, errors of the self-check.
    """
    scheme, joints = coupling.get("scheme"), coupling.get("fine_joints")
    rows = [
        ("scheme", scheme and SCHEMES.get(scheme, scheme)),
        ("reason", coupling.get("why")),
        ("direction", DIRECTIONS.get(coupling.get("direction", ""))),
        ("fine joints", " ".join(joints) if joints is not None and not isinstance(joints, str) else joints),
        ("fine layers", " ".join(coupling.get("fine_layers", ()))),
        ("selection of fine joints", found_by),
        ("window", nano(model["window"])),
        ("step ratio m", number(model["substeps"])),
        ("meso share f of the elements", _share(coupling.get("meso_share"))),
        ("nodes of the coupling interface", _number(coupling.get("cut_nodes"))),
        *((SELF_CHECK.get(name, name), _checked(name, value)) for name, value in _numbers(coupling, "self_check")),
    ]
    return {"head": ["two scales", ""], "rows": [[name, text] for name, text in rows if text]}


def levels(coupling: Record) -> dict | None:
    """Return the table of step levels of a two-scale run, from the window (level 0) inwards.

    Args:
        coupling: Entry ``coupling`` of a ``result.json``; ``levels`` lists ``step`` [s], ``elements``, ``cost_share``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): level, time step, number of hexahedra and
        share of the cost; None without levels.
    """
    rows = [
        [str(level), nano(record["step"]), number(record["elements"]), _share(record.get("cost_share")) or "–"]
        for level, record in enumerate(coupling.get("levels", ()))
    ]
    return {"head": ["level", "time step", "hexahedra", "share of the cost"], "rows": rows} if rows else None


def placement(coupling: Record) -> dict | None:
    """Return the table of predicted and measured window times and the load of the ranks; None without them.

    Args:
        coupling: Entry ``coupling`` of a ``result.json``, with its ``placement``.

    Returns:
        Table with ``head`` (column titles) and ``rows`` (lists of text): name and value; None without a placement.
    """
    record = coupling.get("placement", {})
    rows = [
        (f"window, predicted, {name}{' (chosen)' if name == record.get('chosen') else ''}", short(seconds))
        for name, seconds in _numbers(record, "alternatives")
    ]
    rows += [("window, measured", short(record["window_seconds"]))] if "window_seconds" in record else []
    rows += [(f"rank {rank}, computing", _share(share)) for rank, share in enumerate(record.get("busy_shares", ()))]
    rows += (
        [("coupling, share of a window", _share(record["coupling_overhead"]))] if "coupling_overhead" in record else []
    )
    return {"head": ["placement", ""], "rows": [list(row) for row in rows]} if rows else None


def oracle(seconds: float, results: Sequence[Record]) -> str:
    """Return sentences that compare the processor time of a two-scale run with one model with implicit steps.

    Args:
        seconds: Predicted time of the implicit run on one rank [s].
        results: Contents of ``result.json`` of the two-scale run and, if there was one, of the preceding coarse run;
            ``timings`` and ``model`` are read.
    """
    core_seconds = sum(result["timings"]["windows"] * result["model"]["ranks"] for result in results)
    runs = "the two-scale run" if len(results) == 1 else "the two-scale run and the preceding coarse run"
    winner = "implicit steps are cheaper" if seconds < core_seconds else "two scales are cheaper"
    return (
        f"All materials are linear elastic, so {winner}: one model with implicit steps (MUMPS, one factorisation) is"
        f" predicted to take {seconds:.0f} core seconds; {runs} took {core_seconds:.0f}. Plastic solder, finite"
        " rotations and failure need explicit steps."
    )


def _numbers(record: Record, name: str) -> list[tuple[str, float]]:
    return [(key, value) for key, value in record.get(name, {}).items() if isinstance(value, int | float)]


def _share(value: float | None) -> str:
    return "" if value is None else f"{100.0 * value:.3g} %"


def _number(value: int | None) -> str:
    return "" if value is None else number(value)


def _checked(name: str, value: float) -> str:
    return quantity({"value": value, "unit": "kg"}) if name.endswith("_mass") else f"{value:.2e}"
