"""Records of a division of cells into models and step levels, with its rules and coupling scheme."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.estimates.estimate import WindowPlan, window_plan
from reflowshock.fem.problem.shock import Coupling, Shock

SchemeName = Literal["held_velocity", "local_steps", "impulse", "gravouil_combescure"]
BUFFERED: tuple[SchemeName, ...] = ("held_velocity", "impulse")  # schemes with layers of board around the joints


@dataclass(frozen=True, slots=True)
class Rules:
    """Input of a division.

    Attributes:
        coupling: Coupling settings of the user.
        coarse: Cells of the board, which form the macro model in two-way coupling, shape (ne,).
        fraction: Step over critical step.
        stiffness: Coefficient beta of stiffness-proportional damping [s].
        duration: Simulated time [s].
        samples: Number of history samples.
        copied: Fine cells of which the driving model has a coarse copy, shape (ne,); only for one-way coupling.
        copy: Coarse copies of these cells, shape (ne,); only for one-way coupling.
        sprung: Whether supports have springs.
        pushed: Whether stiffness-proportional damping, springs or initial stress act in the meso model.
        shaken: Nodes on which a large mass acts, shape (k,).
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
        """Return the rules of a drop of ``duration`` [s]; ``cooled``: with residual stress from cooling."""
        return cls(
            coupling=shock.coupling,
            coarse=coarse,
            fraction=shock.numerics.step_fraction,
            stiffness=shock.damping.coefficients[1],
            duration=duration,
            samples=shock.numerics.history_samples,
            sprung=sprung,
            pushed=sprung or cooled or bool(shock.damping.coefficients[1]),
        )

    def plan(self, macro_step: float, meso_step: float) -> WindowPlan:
        """Return windows and substeps for the critical steps of macro and meso model [s]."""
        return window_plan(macro_step, meso_step, self.fraction, self.duration, self.samples)


@dataclass(frozen=True, slots=True)
class Division:
    """Cells of each model and their step levels.

    Attributes:
        scheme: Coupling scheme.
        macro: Cells of the macro model, shape (ne,).
        meso: Cells of the meso model, shape (ne,); both models overlap only in one-way coupling.
        level: Step level of each cell, 0 for the window, shape (ne,) int32.
        ratios: Steps of level k + 1 in one step of level k.
        plan: Windows and substeps.
        copy: Cells of the macro model that represent finer cells of the meso model, shape (ne,), or None.
        why: Reason for the scheme.
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
        """Cells outside the meso model, without coarse copies, shape (ne,)."""
        outside = self.macro & ~self.meso
        return outside if self.copy is None else outside & ~self.copy

    @property
    def overlaps(self) -> bool:
        """Whether both models have cells in common."""
        return bool((self.macro & self.meso).any())

    @property
    def local(self) -> bool:
        """Whether the levels are inside the force term of the meso model (local time steps)."""
        return self.scheme == "local_steps"

    @property
    def counts(self) -> NDArray[np.int64]:
        """Steps of each level in a window, shape (levels + 1,)."""
        return np.cumprod([1, *self.ratios])

    @property
    def every(self) -> NDArray[np.int32]:
        """Pace of each cell: number of steps of its model in which it acts once, shape (ne,)."""
        if self.local:
            return np.ones(len(self.level), np.int32)
        rest = self.plan.substeps // self.counts
        return np.where(self.meso, rest[self.level], 1).astype(np.int32)

    @property
    def meso_step(self) -> float:
        """Step of the meso model's motion [s], which is the window if local steps are inside its force term."""
        return self.plan.window if self.local else self.plan.step


@dataclass(frozen=True, slots=True)
class Choice:
    """Coupling scheme and the reason for it."""

    scheme: SchemeName
    why: str


def choose_scheme(elastic: bool, buffer_possible: bool) -> Choice:
    """Choose the coupling scheme of a two-way run with ``scheme = "auto"``, with the reason as text.

    The choice is ``local_steps`` for an elastic meso model, else ``held_velocity`` if a buffer is possible, else
    ``gravouil_combescure``. All schemes are stable at the steps that a run chooses (benchmarks/coupling_stability.py).
    Local steps conserve energy and momentum, but support no path-dependent materials: plastic strains would follow a
    mean motion and be wrong by a factor of two (PHYSICS 4). Held velocity advances both models concurrently. Impulses
    conserve momentum exactly with path-dependent materials, but the models alternate, so they are used only on request.
    Gravouil-Combescure dissipates energy at the interface, and the models alternate, too.

    Args:
        elastic: Whether the whole meso model is linear elastic at small strains.
        buffer_possible: Whether two layers of board fit between fine cells and the macro model.

    Returns:
        Name of the scheme and the reason as text.
    """
    if elastic:
        return Choice("local_steps", "all elements with small steps are linear elastic at small strains")
    if buffer_possible:
        return Choice("held_velocity", "elements with small steps are path-dependent; layers of board fit around them")
    return Choice(
        "gravouil_combescure", "elements with small steps are path-dependent; no two layers of board fit around them"
    )
