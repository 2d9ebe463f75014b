"""How the cells of a whole mesh are divided: which model has them, at which level of step they are."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from reflowshock.fem.estimates.estimate import WindowPlan

SchemeName = Literal["held_velocity", "local_steps", "impulse", "gravouil_combescure"]
BUFFERED: tuple[SchemeName, ...] = ("held_velocity", "impulse")  # schemes whose interface lies below layers of board


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
    def meso_step(self) -> float:
        """Return the step of the meso model's motion [s]: with local steps these are inside its force."""
        return self.plan.window if self.scheme == "local_steps" else self.plan.step
