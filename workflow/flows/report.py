"""Report of a flow: particles over time, curves next to exact or measured ones, metrics with their limits."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.particles.flows.flow import FlowScene
from reflowshock.workflow.case.text import short
from reflowshock.workflow.flows.flow_kind import STAGE, FlowCase, FlowKind
from reflowshock.workflow.report.scene import Field, Group, Scene
from reflowshock.workflow.report.tables import figures_of, limited_metrics

if TYPE_CHECKING:
    from reflowshock.particles.flows.result import FlowResult

VIEWS = {2: (0.0, -1.0, 0.0), 3: (0.3, -1.0, 0.25)}  # dimension -> direction towards the viewer
NO_FACES = np.zeros((0, 3), dtype=int)


def add_flow(flow: FlowKind, run_folder: Path, case: FlowCase, context: dict, summary: dict) -> None:
    """Add the section of a flow to the context of the report: headline, table of metrics, charts and scene.

    Args:
        flow: Kind of flow.
        run_folder: Run folder with the products.
        case: Case of the run.
        context: Context of the page's template, changed in place: ``headline``, ``tables``, ``curves``, ``scenes``,
            ``flow_caption``.
        summary: Content of ``summary.json``, of which ``metrics`` and ``health`` are read.
    """
    from reflowshock.particles.scenes.products import read_flow

    products, metrics = run_folder / STAGE, summary["metrics"]
    result = read_flow(products)
    context["headline"] = figures_of(flow.headline, metrics, flow.text)
    context["tables"]["flow"] = limited_metrics(metrics, summary["health"], flow.text)
    context["flow_caption"] = flow.caption
    context["curves"]["flow"] = flow.curves(case.scene, result)
    flow.add_products(products, context)
    context["scenes"]["flow"] = flow_scene(result, case.scene)


def flow_scene(result: "FlowResult", scene: FlowScene) -> Scene:
    """Return the particles at the stored times, coloured by speed and pressure, and the walls.

    Args:
        result: Products of the stage ``particles``.
        scene: Parameters of the flow.

    Returns:
        Interactive 3D scene for the report page, one frame per stored time.
    """
    pictures = result.pictures
    frames = [short(picture.time) if scene.dimension == 3 else f"{1e3 * picture.time:.4g} ms" for picture in pictures]
    speeds = [np.sqrt((picture.velocity**2).sum(axis=1)) for picture in pictures]
    highest = max(float(np.quantile(speed, 0.99)) for speed in speeds)
    pressures = np.concatenate([picture.pressure for picture in pictures])
    low, high = (float(value) for value in np.quantile(pressures, (0.02, 0.98)))
    size = 0.9 * scene.spacing
    groups = [
        Group(
            "liquid", picture.points, NO_FACES, np.zeros(len(picture.points), dtype=int), "#5f86ad", only=frame,
            size=size, values={"speed": speed[None], "pressure": picture.pressure[None]},
        )
        for frame, (picture, speed) in enumerate(zip(pictures, speeds, strict=True))
    ]  # fmt: skip
    if len(result.walls):
        groups.append(Group("walls", result.walls, NO_FACES, np.ones(len(result.walls), dtype=int), size=size))
    fields = [Field("speed", "m/s", 0.0, highest), Field("pressure", "Pa", low, high)]
    return Scene(groups, ["liquid", "wall"], fields, frames, start=len(frames) - 1, view=VIEWS[scene.dimension])
