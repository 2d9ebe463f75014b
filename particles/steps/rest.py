"""Running a flow until the body is at rest."""

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
RECORDS = (*FLOW_RECORDS, Snapshot)  # that a flow and its run consist of in a checkpoint
COUNTS = ("seconds", "ruptured", "calm", "at_rest", "moved")


class SchemeUnstable(RuntimeError):
    """A scheme that does not hold has come to its end."""


class NotAtRest(RuntimeError):
    """The body did not come to rest within the allowed steps."""


@dataclass(frozen=True, slots=True)
class StopRule:
    """When a run ends.

    Attributes:
        max_steps: steps after which it has failed.
        tolerance: relative change of energy in a step below which a body is at rest.
        calm_time: time in which the surface of a body at rest moves less than 1e-4 spacings [s].
        end_time: physical end of the process [s]; infinite in the quasi-static mode.
        lasting: time that a body is calm for before it is at rest [s]. Where it swings, a quarter of its slowest swing:
            one that hardly decays is calm where it turns, but moves fastest a quarter later.
    """

    max_steps: int
    tolerance: float
    calm_time: float
    end_time: float = float("inf")
    lasting: float = 0.0


@dataclass(slots=True)
class Run:
    """The steps of a run and its snapshots.

    Attributes:
        records: what each step did.
        profiles: the shape after each step.
        snapshots: the first, the last and some states between.
        seconds: wall time of the steps, those before a restart included [s].
        ruptured: whether the neck became thinner than two spacings.
        calm: last steps that hardly moved the body.
        at_rest: whether it came to rest; else the process ended, or the neck ruptured, before it did.
        moved: displacement since the last snapshot, over the spacing.
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
        """All of it, for a checkpoint."""
        return {name: getattr(self, name) for name in COUNTS} | {
            "records": columns([fields_of(record) for record in self.records]),
            "areas": np.array([profile.areas.coef for profile in self.profiles]),
            "spans": np.array([profile.areas.domain for profile in self.profiles]),
            "snapshots": self.snapshots,
        }

    @classmethod
    def restored(cls, saved: Mapping[str, Any]) -> "Run":
        """Make it again of what `saved` returned."""
        return cls(
            records=[StepRecord(**row) for row in rows(saved["records"])],
            profiles=[Profile.of(Legendre(*fit)) for fit in zip(saved["areas"], saved["spans"], strict=True)],
            snapshots=saved["snapshots"],
            **{name: saved[name] for name in COUNTS},
        )

    @property
    def time_at_rest(self) -> float:
        """When the body came to rest: the end of the third of its calm steps [s]; not a number where it did not."""
        return self.records[CALM_STEPS - 1 - self.calm].time if self.at_rest else float("nan")

    def history(self, viscosity_over_tension: float) -> dict[str, NDArray]:
        """Columns of the records, with width and capillary number mu v / gamma.

        Where a plate was moved by a known force they have this, too, and the standoff.
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
    """Step until surface and energy hardly change for three steps and as long as the rule says, or to the end time.

    Args:
        flow: the flow; advanced in place.
        rule: when to stop.
        progress: called with the estimated fraction done, in [0, 1].
        on_snapshot: called with each new snapshot.
        checkpoint: where the run continues from, to the last bit, and leaves its state, that at rest included.

    Raises:
        NotAtRest: too many steps; names step, displacement and time.
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
    """Start a run, or continue that of the checkpoint, whose state the flow takes over."""
    saved = None if checkpoint is None else checkpoint.read((*flow.records, Snapshot))
    if saved is not None:
        flow.restore(saved["flow"])
        return Run.restored(saved["run"])
    run = Run()
    _snap(run, flow, on_snapshot)
    return run


def saved_run(flow: LiquidFlow, run: Run) -> dict[str, Any]:
    """What a checkpoint keeps of a flow and its run, made of `RECORDS`."""
    return {"flow": flow.saved(), "run": run.saved()}


def _limit_steps(flow: LiquidFlow, run: Run, rule: StopRule) -> None:
    if flow.steps < rule.max_steps:
        return
    last = run.records[-1]
    raise NotAtRest(
        f"no rest after {last.step} steps (solder.numerics.max_steps) at time {last.time:.3g} s: the surface "
        f"still moves {_motion(last, rule):.2e} spacings in {rule.calm_time:.3g} s, at rest it would be "
        f"{CALM_DISPLACEMENT:g}{_for_how_long(rule)}; {_what_helps(flow)}"
    )


def _for_how_long(rule: StopRule) -> str:
    return f" for {rule.lasting:.3g} s" if rule.lasting > 0.0 else ""


def _what_helps(flow: LiquidFlow) -> str:
    if flow.physics.momenta:
        return 'more steps help or, where only the shape at rest matters, solder.effects.inertia = "off"'
    return "more steps or a larger solder.numerics.time_step_limit help"


def _advance(run: Run, flow: LiquidFlow, rule: StopRule) -> None:
    start = perf_counter()
    record = _step(flow)
    _refuse_plates_that_met(flow)
    run.records.append(record)
    run.profiles.append(flow.profile())
    run.ruptured = len(flow.body.cloud.rings) == 2 and _ruptures(run.profiles, flow.body.cloud.spacing)
    calm = is_calm(run.records, rule) and not is_driven(flow.body, flow.physics, record.time_step)
    run.calm = run.calm + 1 if calm else 0
    run.at_rest = is_lasting(run.records, run.calm, rule)
    run.moved += record.displacement
    run.seconds += perf_counter() - start


def _step(flow: LiquidFlow) -> StepRecord:
    """Advance one step; an error of the solver tells where it happened and what may help."""
    where = f"step {flow.steps + 1} at time {flow.time:.4g} s"
    try:
        with threads_for(len(flow.body.points)):
            return flow.step()
    except (ArithmeticError, SolveFailed, StepCollapsed) as error:
        if flow.solver.traits.flaw is not None:
            raise SchemeUnstable(f"{where}: {flow.solver.traits.flaw} ({type(error).__name__}: {error})") from error
        if not isinstance(error, SolveFailed | ZeroDivisionError):
            raise
        raise SolveFailed(f"{where}: {error}; a smaller spacing or solder.numerics.time_step_limit may help") from error


def _refuse_plates_that_met(flow: LiquidFlow) -> None:
    low, high = flow.body.span()
    if len(flow.body.cloud.rings) == 2 and high <= low:
        raise NotAtRest(
            f"step {flow.steps} at time {flow.time:.4g} s: the package has sunk to the board, the solder does not bear "
            "it; a smaller joint.package.load or a larger joint.volume helps"
        )


def _ruptures(profiles: list[Profile], spacing: float) -> bool:
    """Whether a neck of less than two spacings gets thinner still: the particles cannot follow it any further."""
    thin = profiles[-1].waist < RUPTURE_SPACINGS * spacing
    return thin and len(profiles) > 1 and profiles[-1].waist < profiles[-2].waist


def _motion(record: StepRecord, rule: StopRule) -> float:
    """Displacement of the surface in the calm time, over the spacing."""
    return record.displacement * rule.calm_time / record.time_step


def is_calm(records: Sequence[StepRecord], rule: StopRule) -> bool:
    """Whether the last step hardly moved the surface and hardly changed the energy."""
    if len(records) < 2:
        return False
    before, last = records[-2:]
    change = abs(last.energy - before.energy)
    return _motion(last, rule) < CALM_DISPLACEMENT and change < rule.tolerance * abs(last.energy)


def is_lasting(records: Sequence[StepRecord], calm: int, rule: StopRule) -> bool:
    """Whether a body whose last `calm` steps hardly moved it is at rest: three steps, and as long as the rule says."""
    return calm >= CALM_STEPS and sum(record.time_step for record in records[-calm:]) >= rule.lasting


def fraction_done(records: Sequence[StepRecord], rule: StopRule) -> float:
    """Share of the way to rest: the motion dies out exponentially; or share of the process time."""
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
