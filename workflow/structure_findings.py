"""What the stages of a structure found: its mesh, its motion, one solver against the other."""

from collections.abc import Mapping

from workflow.findings import metric
from workflow.stage_runner import Findings


def of_mesh(elements: Mapping[str, int]) -> Findings:
    """Say how many elements each layer has."""
    counts = {f"elements_{layer}": metric(count) for layer, count in elements.items()}
    return Findings(metrics=counts | {"elements": metric(sum(elements.values()))})


def of_motion(results: Mapping[str, dict]) -> Findings:
    """Judge the motion by what each solver found, ``result.json``; the figures of the first one count."""
    first = next(iter(results))
    metrics, health = dict(results[first]["metrics"]), dict(results[first]["health"])
    for solver, result in results.items():
        if solver != first:
            metrics |= {f"{solver}_{name}": value for name, value in result["metrics"].items()}
            health |= {f"{solver}_{name}": value for name, value in result["health"].items()}
    return Findings(metrics, health, dict(results[first]["effects"]))
