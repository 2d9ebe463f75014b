"""Stage ``particles``: computes a flow, writes its products and checks its metrics."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from reflowshock.particles.flows.flow_effects import decide_flow
from reflowshock.workflow.case.run import Findings, Run, at_least, at_most, metric
from reflowshock.workflow.flows.flow_kind import STAGE, FlowCase, FlowKind
from reflowshock.workflow.process.terminal import progress_bar


def run_flow(flow: FlowKind, run: Run[Any], folder: Path) -> Findings:
    """Compute a flow and write its products.

    Args:
        flow: Kind of flow.
        run: Run with its case.
        folder: Folder into which ``flow.h5``, ``particles.vtu`` and further products are written.

    Returns:
        Metrics (``value`` and ``unit`` by name), health checks (``value``, ``limit``, ``ok``) and effects.
    """
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.scenes.products import write_flow

    case: FlowCase = run.case
    scene = case.scene
    checkpoint = Checkpoint(run.checkpoints(STAGE) / case.kind, (scene,))
    with progress_bar(f"flow of {scene.particles} particles") as progress:
        result = flow.solve(scene, folder, progress, checkpoint)
    write_flow(folder, result)
    metrics = {name: metric(value, unit) for name, (value, unit) in result.metrics.items() if value == value}
    metrics |= {name: metric(word, "") for name, word in result.words.items()}
    health = {name: at_most(abs(result.metrics[name][0]), limit) for name, limit in flow.limits(scene).items()}
    for name, limit in flow.lower_limits.items():
        if name in metrics:
            health[name] = at_least(metrics[name]["value"], limit)
    findings = Findings(metrics, health, dict(decide_flow(scene)))
    return replace(findings, continued="the flow" if checkpoint.continued else "")
