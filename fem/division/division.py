"""How the cells of a whole mesh are divided: by which rules and scheme, into which models and levels of steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.estimates.estimate import WindowPlan, window_plan
from reflowshock.fem.problem.shock import Coupling, Shock

SchemeName = Literal["held_velocity", "local_steps", "impulse", "gravouil_combescure"]
BUFFERED: tuple[SchemeName, ...] = ("held_velocity", "impulse")  # schemes whose interface lies below layers of board


@dataclass(frozen=True, slots=True)
class Rules:
    """What a division follows.

    Attributes:
        coupling: What the user wants.
        coarse: ``(ne,)`` cells that are the macro model's where velocities or forces are coupled: a board's.
        fraction: Of the critical step that is used.
        stiffness: beta of damping [s].
        duration: Simulated time [s].
        samples: History samples wanted.
        copied: One way, ``(ne,)`` fine cells of which the driving model has a coarse copy.
        copy: These copies.
        sprung: Whether supports have springs.
        pushed: Whether more than body accelerations and elements act in the meso model: damping, springs, stress at
            rest.
        shaken: ``(k,)`` nodes on which a large mass acts.
    """

    coupling: Coupling
    coarse: NDArray[np.bool_]
    fraction: float
    stiffness: float
    duration: float
    samples: int
    copied: NDArray[np.bool_] | None = None
    copy: NDArray[np.bool_] | None = None
    sprung: bool = False
    pushed: bool = True
    shaken: Sequence[int] | NDArray[np.int32] = ()

    @classmethod
    def of_shock(
        cls, shock: Shock, coarse: NDArray[np.bool_], duration: float, *, sprung: bool, cooled: bool
    ) -> "Rules":
        """Return the rules of a drop of ``duration`` [s]; ``cooled`` means that stress of cooling is at rest in it."""
        return cls(
            coupling=shock.coupling,
            coarse=coarse,
            fraction=shock.numerics.step_fraction,
            stiffness=shock.damping.coefficients[1],
            duration=duration,
            samples=shock.numerics.history_samples,
            sprung=sprung,
            pushed=sprung or cooled or any(shock.damping.coefficients),
        )

    def plan(self, macro_step: float, meso_step: float) -> WindowPlan:
        """Return the windows that follow from two critical steps [s]."""
        return window_plan(macro_step, meso_step, self.fraction, self.duration, self.samples)


@dataclass(frozen=True, slots=True)
class Division:
    """The cells of each model, and the steps that they take.

    Attributes:
        scheme: How the models are coupled.
        macro: ``(ne,)`` cells of the macro model; all of them where there is one model only.
        meso: ``(ne,)`` cells of the meso model: the others, unless the macro model takes nothing back from it.
        level: ``(ne,)`` int32 level of the step of each cell, 0 for the window.
        ratios: Steps of level k + 1 in one of level k.
        plan: Window and substeps.
        copy: One way, ``(ne,)`` cells of the macro model that stand for finer ones of the meso model.
        why: Why this scheme, in words.
    """

    scheme: SchemeName
    macro: NDArray[np.bool_]
    meso: NDArray[np.bool_]
    level: NDArray[np.int32]
    ratios: tuple[int, ...]
    plan: WindowPlan
    copy: NDArray[np.bool_] | None = None
    why: str = ""

    @property
    def around(self) -> NDArray[np.bool_]:
        """Return the cells ``(ne,)`` outside the meso model, up to which it reaches."""
        outside = self.macro & ~self.meso
        return outside if self.copy is None else outside & ~self.copy

    @property
    def overlaps(self) -> bool:
        """Whether both models have some cells."""
        return bool((self.macro & self.meso).any())

    @property
    def local(self) -> bool:
        """Whether levels are inside the meso model's force; else its motion has the step of the innermost one."""
        return self.scheme == "local_steps"

    @property
    def counts(self) -> NDArray[np.int64]:
        """Return the steps ``(levels + 1,)`` of each level in a window."""
        return np.cumprod([1, *self.ratios])

    @property
    def every(self) -> NDArray[np.int32]:
        """Return in how many steps of its model's motion each cell ``(ne,)`` acts once."""
        if self.local:
            return np.ones(len(self.level), np.int32)
        rest = self.plan.substeps // self.counts
        return np.where(self.meso, rest[self.level], 1).astype(np.int32)

    @property
    def meso_step(self) -> float:
        """Return the step of the meso model's motion [s]: with local steps these are inside its force."""
        return self.plan.window if self.local else self.plan.step


@dataclass(frozen=True, slots=True)
class Choice:
    """A scheme, and the reason in words."""

    scheme: SchemeName
    why: str


def choose_scheme(elastic: bool, buffer_possible: bool) -> Choice:
    """Choose the scheme of a two-way run whose user leaves it open.

    All are stable at the steps that a run chooses (benchmarks/coupling_stability.py). Local steps keep energy and
    momentum but know no path: plastic strains would be those of a mean motion, half as large or twice (PHYSICS 4). Held
    velocity lets both models work at the same time; impulses, which keep momentum exactly along a path, do not, and are
    taken where the user asks for them. Gravouil-Combescure's link takes energy from what moves, and waits, too.

    Args:
        elastic: Whether all of the meso model is linear elastic at small strains.
        buffer_possible: Whether two layers of board fit between what is fine and the macro model.
    """
    if elastic:
        return Choice("local_steps", "all that takes small steps is linear elastic at small strains")
    if buffer_possible:
        return Choice("held_velocity", "what takes small steps depends on its path; layers of board fit around it")
    return Choice(
        "gravouil_combescure", "what takes small steps depends on its path; no two layers of board fit around it"
    )
