"""Run of a flow until the body is at rest, with snapshots, progress and checkpoints."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite, log
from time import perf_counter
from typing import Any

import numpy as np
from numpy.polynomial import Legendre
from numpy.typing import NDArray

from reflowshock.data_file import columns, fields_of, rows
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.core.threads import threads_for
from reflowshock.particles.discretisation.incompressibility import SolveFailed
from reflowshock.particles.steps.descent import is_driven
from reflowshock.particles.steps.flow import FLOW_RECORDS, LiquidFlow, StepRecord
from reflowshock.particles.steps.shape import Snapshot
from reflowshock.particles.steps.time_step import StepCollapsed
from reflowshock.particles.surface.profile import Profile

CALM_STEPS = 3
CALM_DISPLACEMENT = 1e-4
SNAPSHOT_DISPLACEMENT = 0.1
RUPTURE_SPACINGS = 2.0
RECORDS = (*FLOW_RECORDS, Snapshot)  # dataclasses in a checkpoint of a flow and its run
COUNTS = ("seconds", "ruptured", "calm", "at_rest", "moved")


class SchemeUnstable(RuntimeError):
    """Error of a scheme that is known to be unstable."""


class NotAtRest(RuntimeError):
    """Error of a body that did not come to rest within the allowed steps."""


@dataclass(frozen=True, slots=True)
class StopRule:
    """Criteria by which a run ends.

    Attributes:
        max_steps: Number of steps after which it has failed.
        tolerance: Relative change of energy in a step below which a body is calm.
        calm_time: Time in which the surface of a calm body moves less than 1e-4 spacings [s].
        end_time: Physical end of the process [s]; infinite in the quasi-static mode.
        lasting: Time for which a body must be calm to be at rest [s]. For an oscillating body this is a quarter of its
            slowest period: a weakly damped oscillation is calm at its turning points and fastest a quarter later.
    """

    max_steps: int
    tolerance: float
    calm_time: float
    end_time: float = float("inf")
    lasting: float = 0.0


@dataclass(slots=True)
class Run:
    """Steps of a run and its snapshots.

    Attributes:
        records: Record of each step.
        profiles: Profile of the body after each step.
        snapshots: First, last and intermediate snapshots.
        seconds: Wall time of the steps, including those before a restart [s].
        ruptured: Whether the neck became thinner than two spacings.
        calm: Number of consecutive calm steps at the end.
        at_rest: Whether the body came to rest before the process ended or the neck ruptured.
        moved: Displacement since the last snapshot, over the spacing.
    """

    records: list[StepRecord] = field(default_factory=list)
    profiles: list[Profile] = field(default_factory=list)
    snapshots: list[Snapshot] = field(default_factory=list)
    seconds: float = 0.0
    ruptured: bool = False
    calm: int = 0
    at_rest: bool = False
    moved: float = 0.0

    def saved(self) -> dict[str, Any]:
        """Return the data that a checkpoint keeps."""
        return {name: getattr(self, name) for name in COUNTS} | {
            "records": columns([fields_of(record) for record in self.records]),
            "areas": np.array([profile.areas.coef for profile in self.profiles]),
            "spans": np.array([profile.areas.domain for profile in self.profiles]),
            "snapshots": self.snapshots,
        }

    @classmethod
    def restored(cls, saved: Mapping[str, Any]) -> "Run":
        """Return the run whose data ``saved`` returned."""
        return cls(
            records=[StepRecord(**row) for row in rows(saved["records"])],
            profiles=[Profile.of(Legendre(*fit)) for fit in zip(saved["areas"], saved["spans"], strict=True)],
            snapshots=saved["snapshots"],
            **{name: saved[name] for name in COUNTS},
        )

    @property
    def time_at_rest(self) -> float:
        """Time at which the body came to rest, the end of its third calm step [s]; NaN if it did not."""
        return self.records[CALM_STEPS - 1 - self.calm].time if self.at_rest else float("nan")

    def history(self, viscosity_over_tension: float) -> dict[str, NDArray]:
        """Return the records as columns, with the width and the capillary number mu v / gamma.

        Standoff and force on the plate are included if a plate moved by a known force.

        Args:
            viscosity_over_tension: Viscosity over surface tension [s/m].
        """
        names: tuple[str, ...] = (
            "step",
            "time",
            "time_step",
            "binding",
            "height",
            "volume",
            "energy",
            "displacement",
            "iterations",
        )
        if any(isfinite(record.pull) for record in self.records):
            names = (*names, "standoff", "pull")
        columns = {name: np.array([getattr(record, name) for record in self.records]) for name in names}
        if self.profiles:
            columns["width"] = np.array([profile.max_width for profile in self.profiles])
        speed = np.array([record.speed for record in self.records])
        columns["capillary_number"] = viscosity_over_tension * speed
        return columns


def run_to_rest(
    flow: LiquidFlow,
    rule: StopRule,
    progress: Callable[[float], None] | None = None,
    on_snapshot: Callable[[Snapshot], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> Run:
    """Advance a flow until the body is at rest, a neck ruptures, or the process ends.

    A body is at rest after three calm steps that last as long as the rule requires.

    Args:
        flow: Liquid body with its physics and step solver; advanced in place.
        rule: Criteria by which the run ends: tolerance and duration of rest, number of steps, end of the process.
        progress: Function called with the estimated fraction done, in [0, 1].
        on_snapshot: Function called with each new snapshot.
        checkpoint: Checkpoint from which the run continues to the bit, and to which it writes its state.

    Returns:
        Record and profile of each step, snapshots, and whether the neck ruptured or the body came to rest.

    Raises:
        NotAtRest: The body is not at rest after the allowed steps.
    """
    run, done = _start(flow, on_snapshot, checkpoint), 0.0
    while not run.at_rest and flow.time < rule.end_time and not run.ruptured:
        _limit_steps(flow, run, rule)
        _advance(run, flow, rule)
        if run.moved > SNAPSHOT_DISPLACEMENT:
            _snap(run, flow, on_snapshot)
        if checkpoint is not None and checkpoint.is_due():
            checkpoint.write(saved_run(flow, run))
        done = max(done, fraction_done(run.records, rule))
        if progress is not None:
            progress(done)
    if run.moved > 0.0:
        _snap(run, flow, on_snapshot)
    if checkpoint is not None:
        checkpoint.write(saved_run(flow, run))
    if progress is not None:
        progress(1.0)
    return run


def _start(flow: LiquidFlow, on_snapshot: Callable[[Snapshot], None] | None, checkpoint: Checkpoint | None) -> Run:
    """Start a run, or restore the run and the flow from the checkpoint."""
    saved = None if checkpoint is None else checkpoint.read((*flow.records, Snapshot))
    if saved is not None:
        flow.restore(saved["flow"])
        return Run.restored(saved["run"])
    run = Run()
    _snap(run, flow, on_snapshot)
    return run


def saved_run(flow: LiquidFlow, run: Run) -> dict[str, Any]:
    """Return the data that a checkpoint stores of a flow and its run; the dataclasses in it are listed in ``RECORDS``.

    Args:
        flow: Flow, of which body, physics and step solver are saved.
        run: Records, profiles and snapshots so far.

    Returns:
        Dictionary with the state of the flow under ``flow`` and of the run under ``run``.
    """
    return {"flow": flow.saved(), "run": run.saved()}


def _limit_steps(flow: LiquidFlow, run: Run, rule: StopRule) -> None:
    if flow.steps < rule.max_steps:
        return
    last = run.records[-1]
    raise NotAtRest(
        f"no rest after {last.step} steps (solder.numerics.max_steps) at time {last.time:.3g} s: the surface "
        f"still moves {_motion(last, rule):.2e} spacings in {rule.calm_time:.3g} s, the limit is "
        f"{CALM_DISPLACEMENT:g}{_duration(rule)}; try {_remedy(flow)}"
    )


def _duration(rule: StopRule) -> str:
    return f" for {rule.lasting:.3g} s" if rule.lasting > 0.0 else ""


def _remedy(flow: LiquidFlow) -> str:
    if flow.physics.momenta:
        return 'more steps or, for the shape at rest only, solder.effects.inertia = "off"'
    return "more steps or a larger solder.numerics.time_step_limit"


def _advance(run: Run, flow: LiquidFlow, rule: StopRule) -> None:
    start = perf_counter()
    record = _step(flow)
    _check_standoff(flow)
    run.records.append(record)
    run.profiles.append(flow.profile())
    run.ruptured = len(flow.body.cloud.rings) == 2 and _ruptures(run.profiles, flow.body.cloud.spacing)
    calm = is_calm(run.records, rule) and not is_driven(flow.body, flow.physics, record.time_step)
    run.calm = run.calm + 1 if calm else 0
    run.at_rest = is_lasting(run.records, run.calm, rule)
    run.moved += record.displacement
    run.seconds += perf_counter() - start


def _step(flow: LiquidFlow) -> StepRecord:
    """Advance one step; name step, time and remedies in errors of the solver."""
    where = f"step {flow.steps + 1} at time {flow.time:.4g} s"
    try:
        with threads_for(len(flow.body.points)):
            return flow.step()
    except (ArithmeticError, SolveFailed, StepCollapsed) as error:
        if flow.solver.traits.flaw is not None:
            raise SchemeUnstable(f"{where}: {flow.solver.traits.flaw} ({type(error).__name__}: {error})") from error
        if not isinstance(error, SolveFailed | ZeroDivisionError):
            raise
        raise SolveFailed(
            f"{where}: {error}; try a smaller spacing or a smaller solder.numerics.time_step_limit"
        ) from error


def _check_standoff(flow: LiquidFlow) -> None:
    low, high = flow.body.span()
    if len(flow.body.cloud.rings) == 2 and high <= low:
        raise NotAtRest(
            f"step {flow.steps} at time {flow.time:.4g} s: the package has sunk to the board; "
            "try a smaller joint.package.load or a larger joint.volume"
        )


def _ruptures(profiles: list[Profile], spacing: float) -> bool:
    """Return whether a neck below two spacings gets thinner; particles cannot resolve it any further."""
    thin = profiles[-1].waist < RUPTURE_SPACINGS * spacing
    return thin and len(profiles) > 1 and profiles[-1].waist < profiles[-2].waist


def _motion(record: StepRecord, rule: StopRule) -> float:
    """Return the displacement of the surface in the calm time, over the spacing."""
    return record.displacement * rule.calm_time / record.time_step


def is_calm(records: Sequence[StepRecord], rule: StopRule) -> bool:
    """Return whether the surface and the energy hardly changed in the last step.

    False before the second step.

    Args:
        records: Records of the steps so far, in order; energy and displacement of the last two are used.
        rule: Criteria of rest: relative energy change of a step, and time in which the surface moves 1e-4 spacings.
    """
    if len(records) < 2:
        return False
    before, last = records[-2:]
    change = abs(last.energy - before.energy)
    return _motion(last, rule) < CALM_DISPLACEMENT and change < rule.tolerance * abs(last.energy)


def is_lasting(records: Sequence[StepRecord], calm: int, rule: StopRule) -> bool:
    """Return whether a calm body is at rest: calm for three steps and for the time that the rule requires.

    Args:
        records: Records of all steps so far, in order.
        calm: Number of consecutive calm steps at the end.
        rule: Criteria of rest, with the required time.
    """
    return calm >= CALM_STEPS and sum(record.time_step for record in records[-calm:]) >= rule.lasting


def fraction_done(records: Sequence[StepRecord], rule: StopRule) -> float:
    """Return the estimated fraction of the run that is done, in [0, 1], from the exponential decay of the motion.

    Args:
        records: Records of all steps so far; 0 without any.
        rule: Criteria by which the run ends.
    """
    if not records:
        return 0.0
    first, last = _motion(records[0], rule), _motion(records[-1], rule)
    if first <= CALM_DISPLACEMENT:
        return 1.0
    settled = log(first / max(last, CALM_DISPLACEMENT)) / log(first / CALM_DISPLACEMENT)
    return min(1.0, max(0.0, settled, records[-1].time / rule.end_time))


def _snap(run: Run, flow: LiquidFlow, on_snapshot: Callable[[Snapshot], None] | None) -> None:
    snapshot = flow.snapshot()
    run.snapshots.append(snapshot)
    run.moved = 0.0
    if on_snapshot is not None:
        on_snapshot(snapshot)
