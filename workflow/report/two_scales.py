"""Section "Two scales" of the report: how the models are coupled, what that costs, and what else would cost."""

from collections.abc import Mapping, Sequence
from typing import Any

from reflowshock.workflow.case.text import nano, number, quantity, short

Record = Mapping[str, Any]

SCHEMES = {
    "held_velocity": "held velocity, coupling interface inside the board",
    "local_steps": "local time steps (LTS-leapfrog)",
    "impulse": "impulses at a coupling interface inside the board, carried by the meso model",
    "gravouil_combescure": "Gravouil-Combescure, at the joints' own facets",
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
    """Return how the models are coupled: what the run recorded of it.

    Args:
        coupling: ``coupling`` of the result of a two-scale run.
        model: its ``model``.
        found_by: how its fine joints were found, where a coarse run did; else empty.
    """
    scheme, joints = coupling.get("scheme"), coupling.get("fine_joints")
    rows = [
        ("scheme", scheme and SCHEMES.get(scheme, scheme)),
        ("why", coupling.get("why")),
        ("direction", DIRECTIONS.get(coupling.get("direction", ""))),
        ("fine joints", " ".join(joints) if joints is not None and not isinstance(joints, str) else joints),
        ("fine layers", " ".join(coupling.get("fine_layers", ()))),
        ("how they were chosen", found_by),
        ("window", nano(model["window"])),
        ("step ratio m", number(model["substeps"])),
        ("meso share f of the elements", _share(coupling.get("meso_share"))),
        ("nodes of the coupling interface", _number(coupling.get("cut_nodes"))),
        *((SELF_CHECK.get(name, name), _checked(name, value)) for name, value in _numbers(coupling, "self_check")),
    ]
    return {"head": ["two scales", ""], "rows": [[name, text] for name, text in rows if text]}


def levels(coupling: Record) -> dict | None:
    """Return the levels of time steps: level 0 is the window."""
    rows = [
        [str(level), nano(record["step"]), number(record["elements"]), _share(record.get("cost_share")) or "–"]
        for level, record in enumerate(coupling.get("levels", ()))
    ]
    return {"head": ["level", "time step", "hexahedra", "share of the cost"], "rows": rows} if rows else None


def placement(coupling: Record) -> dict | None:
    """Return the predicted window of every placement, what was measured, and how busy the ranks were."""
    record = coupling.get("placement", {})
    rows = [
        (f"window, predicted, {name}{' (chosen)' if name == record.get('chosen') else ''}", short(seconds))
        for name, seconds in _numbers(record, "alternatives")
    ]
    rows += [("window, measured", short(record["window_seconds"]))] if "window_seconds" in record else []
    rows += [(f"rank {rank} computes", _share(share)) for rank, share in enumerate(record.get("busy_shares", ()))]
    rows += (
        [("coupling, share of a window", _share(record["coupling_overhead"]))] if "coupling_overhead" in record else []
    )
    return {"head": ["placement", ""], "rows": [list(row) for row in rows]} if rows else None


def oracle(seconds: float, results: Sequence[Record]) -> str:
    """Say what one model in implicit steps would cost beside the two-scale run, and which of both wins.

    Args:
        seconds: predicted for the implicit run on one rank.
        results: of the two-scale run, and of the preceding coarse run.
    """
    core_seconds = sum(result["timings"]["windows"] * result["model"]["ranks"] for result in results)
    runs = "the two-scale run" if len(results) == 1 else "the two-scale run and the preceding coarse run"
    winner = "implicit steps are cheaper" if seconds < core_seconds else "two scales are cheaper"
    return (
        f"All is linear elastic here, so {winner}: one model in implicit steps (MUMPS, factored once) is predicted to"
        f" take {seconds:.0f} core seconds, {runs} took {core_seconds:.0f}. Solder that yields, finite"
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
