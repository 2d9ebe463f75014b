"""Reflow of solder alone, without package and board: one function a kind of scene."""

from dataclasses import replace
from pathlib import Path

from reflowshock.workflow.case.run import Findings, Run
from reflowshock.workflow.process.products import write_json
from reflowshock.workflow.process.progress import progress_bar
from reflowshock.workflow.solder import findings
from reflowshock.workflow.solder.case import DropCase, DropsCase, JointCase, OscillationCase


def reflow_drop(run: Run[DropCase], folder: Path) -> Findings:
    """Melt a cube of solder on a wall or pad, or without a wall."""
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.scenes.drop_at_rest import drop_to_rest
    from reflowshock.particles.scenes.products import write_body

    drop, solder = run.case.drop, run.case.molten
    checkpoint = Checkpoint(run.checkpoints("reflow") / "drop", (drop, solder))
    with progress_bar(f"reflow of {drop.particles} particles") as progress:
        result = drop_to_rest(drop, solder, progress, checkpoint)
    write_body(folder, result.shape, result.reference)
    found = findings.of_drop(result.shape.metrics, result.shape.verdict, result.effects)
    return replace(found, continued="the drop" if checkpoint.continued else "")


def reflow_joint(run: Run[JointCase], folder: Path) -> Findings:
    """Melt the solder of one joint between its pads."""
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.scenes.joint_at_rest import joint_to_rest
    from reflowshock.particles.scenes.products import write_body

    joint, solder = run.case.joint, run.case.molten
    used: list[Checkpoint] = []

    def checkpoint(place: int) -> Checkpoint:
        used.append(Checkpoint(run.checkpoints("reflow") / f"joint-{place}", (joint, solder)))
        return used[-1]

    with progress_bar("reflow of a joint") as progress:
        result = joint_to_rest(joint, solder, progress, checkpoint)
    write_body(folder, result.shape, result.reference)
    if result.places:
        write_json(folder / "path.json", result.places)
    found = findings.of_joint(result.shape.metrics, result.shape.verdict, result.effects)
    return replace(found, continued="the joint" if any(one.continued for one in used) else "")


def reflow_drops(run: Run[DropsCase], folder: Path) -> Findings:
    """Let two drops flow until they, or the one that they become, are at rest."""
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.scenes.drop_pair import pair_to_rest
    from reflowshock.particles.scenes.products import write_body

    drops, solder = run.case.drops, run.case.molten
    checkpoint = Checkpoint(run.checkpoints("reflow") / "drops", (drops, solder))
    with progress_bar("reflow of two drops") as progress:
        result = pair_to_rest(drops, solder, progress, checkpoint)
    write_body(folder, result.shape, result.reference)
    found = findings.of_drops(result.shape.metrics, 1 if drops.merge else 2, result.effects)
    return replace(found, continued="the drops" if checkpoint.continued else "")


def reflow_oscillation(run: Run[OscillationCase], folder: Path) -> Findings:
    """Let a free drop swing."""
    from reflowshock.particles.core.checkpoint import Checkpoint
    from reflowshock.particles.parameters.effects import decide_oscillation
    from reflowshock.particles.scenes.free_drop import solve_oscillation
    from reflowshock.particles.scenes.products import write_body

    scene, solder = run.case.oscillation, run.case.molten
    checkpoint = Checkpoint(run.checkpoints("reflow") / "drop", (scene, solder))
    with progress_bar(f"oscillation of {scene.particles} particles") as progress:
        shape = solve_oscillation(scene, solder, progress, checkpoint)
    write_body(folder, shape, None)
    found = findings.of_oscillation(shape.metrics, decide_oscillation(solder))
    return replace(found, continued="the drop" if checkpoint.continued else "")
