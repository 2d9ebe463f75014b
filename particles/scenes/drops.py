"""Several drops that flow until they are at rest: drops that touch merge, and collapsed drops are remeshed.

Drops that overlap at the start are an error.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from time import perf_counter
from typing import Any

from reflowshock.data_file import columns, fields_of, rows
from reflowshock.particles.core.body import Body
from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.scenes.rebuild import collapsing, hand_over, overlap, rebuild, touch
from reflowshock.particles.steps.flow import LiquidFlow, StepRecord
from reflowshock.particles.steps.rest import RECORDS, NotAtRest, StopRule, fraction_done, is_calm, is_lasting
from reflowshock.particles.steps.shape import Snapshot

LARGEST_OVERLAP = 0.5  # spacings


class OverlappingDrops(ValueError):
    """Drops that overlap at the start."""


@dataclass(slots=True, eq=False)
class MovingDrop:
    """Drop that flows until it is at rest.

    Attributes:
        flow: Flow of the drop.
        origins: Numbers of the initial drops that merged into this one.
        first: Particles and surface of the drop at its start.
        parents: Drops that merged into this one, in their state at contact; empty for an initial drop.
        records: Records of its steps since its start.
        calm: Number of its last consecutive steps with hardly any motion.
        at_rest: Whether the drop is at rest.
        seconds: Wall time of its steps [s].
    """

    flow: LiquidFlow
    origins: tuple[int, ...]
    first: Snapshot
    parents: tuple["MovingDrop", ...] = ()
    records: list[StepRecord] = field(default_factory=list)
    calm: int = 0
    at_rest: bool = False
    seconds: float = 0.0

    @classmethod
    def made(cls, flow: LiquidFlow, origins: tuple[int, ...], parents: tuple["MovingDrop", ...] = ()) -> "MovingDrop":
        """Return the drop of a flow that has not moved yet."""
        first = Snapshot(flow.time, flow.body.points.copy(), flow.body.triangles.copy())
        return cls(flow, origins, first, parents)

    def saved(self) -> dict[str, Any]:
        """Return the state for a checkpoint."""
        return fields_of(self) | {
            "flow": self.flow.saved(),
            "parents": [parent.saved() for parent in self.parents],
            "records": columns([fields_of(record) for record in self.records]),
        }

    @classmethod
    def restored(cls, saved: Mapping[str, Any], start: Callable[[Body], LiquidFlow]) -> "MovingDrop":
        """Return the drop restored from the data of ``saved``; ``start`` is as for ``run_drops``."""
        flow = start(Body.at_rest(saved["flow"]["body"].cloud))
        flow.restore(saved["flow"])
        parents = tuple(cls.restored(parent, start) for parent in saved["parents"])
        records = [StepRecord(**row) for row in rows(saved["records"])]
        return cls(**{**saved, "flow": flow, "parents": parents, "records": records})

    def step(self, rule: StopRule) -> None:
        """Advance one time step."""
        start = perf_counter()
        self.records.append(self.flow.step())
        self.seconds += perf_counter() - start
        self.calm = self.calm + 1 if is_calm(self.records, rule) else 0
        self.at_rest = is_lasting(self.records, self.calm, rule)

    def moves(self, rule: StopRule) -> bool:
        """Return whether the drop is neither at rest nor at the end of the process."""
        return not self.at_rest and self.flow.time < rule.end_time


def run_drops(
    flows: Sequence[LiquidFlow],
    rule: StopRule,
    start: Callable[[Body], LiquidFlow],
    checkpoint: Checkpoint | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[MovingDrop]:
    """Compute the flow of drops until all are at rest; the drop with the earliest time advances first.

    Args:
        flows: Flow of each drop, advanced in place.
        rule: Criteria by which the flow of a drop ends: tolerance and duration of rest, number of steps, end of the
            process.
        start: Function of a body that returns its flow, for merged and remeshed drops.
        checkpoint: File from which the run continues, to the last bit, and to which it saves its state.
        progress: Function called with the fraction done, 0 to 1, of the drop with most left to do.

    Returns:
        The remaining drops at rest, each with its flow, its step records, and the drops that merged into it.

    Raises:
        OverlappingDrops: Drops overlap at the start, so that they cannot both have their volume.
        NotAtRest: A drop is not at rest after the steps of the rule.
        CannotRebuild: Drops that touch, or a drop that collapses, cannot be remeshed on their walls.
    """
    saved = checkpoint.read(RECORDS) if checkpoint else None
    drops = [MovingDrop.restored(drop, start) for drop in saved or []] or _merge_touching(_apart(flows), start)
    while moving := [drop for drop in drops if drop.moves(rule)]:
        drop = min(moving, key=lambda candidate: candidate.flow.time)
        if len(drop.records) >= rule.max_steps:
            steps = f"{rule.max_steps} steps (solder.numerics.max_steps)"
            raise NotAtRest(f"drop {drop.origins} is not at rest after {steps}")
        drop.step(rule)
        if drop.moves(rule) and collapsing(drop.flow.body):
            drop.flow = _restarted(start, drop)
        drops = _merge_touching(drops, start)
        if checkpoint is not None and checkpoint.is_due():
            checkpoint.write([drop.saved() for drop in drops])
        if progress is not None:
            progress(min((fraction_done(drop.records, rule) for drop in drops if drop.moves(rule)), default=1.0))
    return drops


def _apart(flows: Sequence[LiquidFlow]) -> list[MovingDrop]:
    """Create the initial drops, which must not overlap by more than half a spacing."""
    for (i, first), (j, second) in combinations(enumerate(flows), 2):
        spacing = min(first.body.cloud.spacing, second.body.cloud.spacing)
        depth = overlap(first.body, second.body)
        if depth > LARGEST_OVERLAP * spacing:
            raise OverlappingDrops(
                f"drops {i} and {j} overlap by {depth:.3g} m at the start, allowed <= {LARGEST_OVERLAP * spacing:.3g} m"
            )
    return [MovingDrop.made(flow, (number,)) for number, flow in enumerate(flows)]


def _restarted(start: Callable[[Body], LiquidFlow], *drops: MovingDrop) -> LiquidFlow:
    """Return the flow of the body into which drops merge, with their momentum and the latest of their times."""
    old = [drop.flow for drop in drops]
    body = rebuild(*(flow.body for flow in old))
    flow = start(body)
    flow.body.velocity = body.velocity
    hand_over(old, [flow])
    return flow


def _merge_touching(drops: list[MovingDrop], start: Callable[[Body], LiquidFlow]) -> list[MovingDrop]:
    """Merge pairs of drops until none touch."""
    while (pair := _touching(drops)) is not None:
        rest = [drop for drop in drops if drop not in pair]
        origins = sorted(pair[0].origins + pair[1].origins)
        drops = [*rest, MovingDrop.made(_restarted(start, *pair), tuple(origins), pair)]
    return drops


def _touching(drops: Sequence[MovingDrop]) -> tuple[MovingDrop, MovingDrop] | None:
    for number, first in enumerate(drops):
        for second in drops[number + 1 :]:
            if touch(first.flow.body, second.flow.body):
                return first, second
    return None
