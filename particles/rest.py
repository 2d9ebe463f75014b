"""Running a flow until the body is at rest."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import log
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from particles.flow import LiquidFlow, StepRecord
from particles.profile import Profile, fit_profile
from particles.shape import Snapshot

CALM_STEPS = 3
CALM_DISPLACEMENT = 1e-4
SNAPSHOT_DISPLACEMENT = 0.1
RUPTURE_SPACINGS = 2.0


class NoRest(RuntimeError):
    """The body did not come to rest within the allowed steps."""


@dataclass(frozen=True, slots=True)
class StopRule:
    """When a run ends.

    Attributes:
        max_steps: steps after which it has failed.
        tolerance: relative change of energy in a step below which a body is at rest.
        end_time: physical end of the process [s]; infinite in the quasi-static mode.
    """

    max_steps: int
    tolerance: float
    end_time: float = float("inf")


@dataclass(slots=True)
class Run:
    """The steps of a run and its snapshots; `ruptured` if the neck became thinner than two spacings."""

    records: list[StepRecord] = field(default_factory=list)
    profiles: list[Profile] = field(default_factory=list)
    snapshots: list[Snapshot] = field(default_factory=list)
    seconds: float = 0.0
    ruptured: bool = False

    def history(self, viscosity_over_tension: float) -> dict[str, NDArray]:
        """Columns of the records, with width and capillary number mu v / gamma."""
        names = ("step", "time", "time_step", "binding", "height", "volume", "energy", "displacement", "iterations")
        columns = {name: np.array([getattr(record, name) for record in self.records]) for name in names}
        columns["width"] = np.array([profile.max_width for profile in self.profiles])
        speed = np.array([record.speed for record in self.records])
        columns["capillary_number"] = viscosity_over_tension * speed
        return columns


def run_to_rest(
    flow: LiquidFlow,
    rule: StopRule,
    progress: Callable[[float], None] | None = None,
    on_snapshot: Callable[[Snapshot], None] | None = None,
) -> Run:
    """Step until the surface hardly moves and the energy hardly changes for three steps, or until the end time.

    Args:
        flow: the flow; advanced in place.
        rule: when to stop.
        progress: called with the estimated fraction done, in [0, 1].
        on_snapshot: called with each snapshot.

    Raises:
        NoRest: too many steps; names step, displacement and time.
    """
    run, start, calm, moved, done = Run(), perf_counter(), 0, 0.0, 0.0
    _snap(run, flow, on_snapshot)
    while calm < CALM_STEPS and flow.time < rule.end_time and not run.ruptured:
        if flow.steps >= rule.max_steps:
            last = run.records[-1]
            raise NoRest(
                f"no rest after {last.step} steps (solder.numerics.max_steps) at time {last.time:.3g} s: the surface "
                f"still moves {last.displacement:.2e} spacings a step, allowed {CALM_DISPLACEMENT:g}"
            )
        record = _advance(run, flow)
        calm = calm + 1 if _is_calm(run, rule.tolerance) else 0
        moved += record.displacement
        if moved > SNAPSHOT_DISPLACEMENT:
            _snap(run, flow, on_snapshot)
            moved = 0.0
        done = max(done, _fraction(run, rule))
        if progress is not None:
            progress(done)
    if moved > 0.0:
        _snap(run, flow, on_snapshot)
    run.seconds = perf_counter() - start
    if progress is not None:
        progress(1.0)
    return run


def _advance(run: Run, flow: LiquidFlow) -> StepRecord:
    record = flow.step()
    profile = fit_profile(flow.body.points, flow.body.triangles)
    run.records.append(record)
    run.profiles.append(profile)
    bridges = len(flow.body.cloud.rings) == 2
    run.ruptured = bridges and profile.waist < RUPTURE_SPACINGS * flow.body.cloud.spacing
    return record


def _is_calm(run: Run, tolerance: float) -> bool:
    if len(run.records) < 2:
        return False
    before, last = run.records[-2:]
    change = abs(last.energy - before.energy)
    return last.displacement < CALM_DISPLACEMENT and change < tolerance * abs(last.energy)


def _fraction(run: Run, rule: StopRule) -> float:
    """Share of the way to rest: the displacement falls exponentially; or share of the process time."""
    first, last = run.records[0].displacement, run.records[-1].displacement
    if first <= CALM_DISPLACEMENT:
        return 1.0
    settled = log(first / max(last, CALM_DISPLACEMENT)) / log(first / CALM_DISPLACEMENT)
    return min(1.0, max(0.0, settled, run.records[-1].time / rule.end_time))


def _snap(run: Run, flow: LiquidFlow, on_snapshot: Callable[[Snapshot], None] | None) -> None:
    snapshot = Snapshot(flow.time, flow.body.points.copy(), flow.body.triangles.copy())
    run.snapshots.append(snapshot)
    if on_snapshot is not None:
        on_snapshot(snapshot)
