"""Parameters of the drop shock: pulse, coupling, ranks.

All values are SI floats; ``Quantity`` names the unit that case files and messages use.
"""

import math
from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from reflowshock.effect import Switch
from reflowshock.fem.problem.failure import Failure
from reflowshock.fem.problem.filters import LowPass
from reflowshock.fem.problem.kinematics import TURNING, Kinematics
from reflowshock.parameters import Parameters
from reflowshock.quantity import Quantity

MOST_RANKS = 100_000  # of one run
AUTO_RANKS = 2  # largest number that "auto" takes: one drop has too little work for more
MOST_LEVELS = 4  # below the window, that "auto" tries
JOINT_LAYER = 25e-6  # [m] of fatigue practice (Darveaux, ECTC 2000); thickness conventions differ
ServiceCondition = Literal["A", "B", "C", "D", "E", "F", "G", "H"]


class Ranks(Parameters):
    """MPI ranks of a run, and their division between the models.

    With ``total = auto`` a run has two ranks if two cores are idle when it starts, otherwise one.
    With ``disjoint`` each model has its own ranks and both models advance at the same time; ``macro`` is the number of
    ranks of the macro model. With ``shared`` all ranks compute both models in turn. ``auto`` takes the placement
    predicted to be fastest from speeds measured at the start of the run.
    """

    total: Literal["auto"] | Annotated[int, Field(ge=1, le=MOST_RANKS)] = "auto"
    placement: Literal["auto", "disjoint", "shared"] = "auto"
    macro: int | None = Field(None, ge=1, le=MOST_RANKS)

    @property
    def most(self) -> int:
        """Largest number of ranks."""
        return AUTO_RANKS if self.total == "auto" else self.total

    @property
    def least(self) -> int:
        """Smallest number of ranks."""
        alone = 1 if self.placement != "disjoint" else AUTO_RANKS
        return alone if self.total == "auto" else self.total

    @field_validator("placement")
    @classmethod
    def _ranks_for_each(cls, value: str, info: ValidationInfo) -> str:
        if value == "disjoint" and info.data.get("total") == 1:
            raise PydanticCustomError(
                "inadmissible", "needs at least one rank for each model", {"allowed": "auto, shared"}
            )
        return value

    @field_validator("macro")
    @classmethod
    def _rank_for_meso(cls, value: int | None, info: ValidationInfo) -> int | None:
        if value is not None and info.data.get("placement", "disjoint") != "disjoint":
            raise PydanticCustomError("inadmissible", "applies only to placement = disjoint", {"allowed": "none"})
        total = info.data.get("total", math.inf)
        most = AUTO_RANKS if total == "auto" else total
        if value is not None and value >= most:
            allowed = f"< {most}, shock.ranks.total"
            raise PydanticCustomError("inadmissible", "leaves no rank for the meso model", {"allowed": allowed})
        return value


class Coupling(Parameters):
    """Coupling of two models; ``auto`` takes local steps if the fine model is linear, else held velocity.

    Where no buffer fits, ``auto`` takes ``gravouil_combescure``, which needs none. ``impulse`` has the buffer of held
    velocity and conserves momentum exactly, but its models wait for each other. With ``one_way`` the macro model drives
    the meso model without feedback. ``levels`` is the number of step levels of the meso model below the window; held
    velocity allows at most three, and only one with stiffness damping, springs, cooling stress or a large mass on nodes
    of the meso model. ``buffer_layers`` is the number of layers of board elements between the joints and an interface
    of held velocity; ``path_levels`` defines the buffers between levels.
    """

    scheme: Literal["auto", "held_velocity", "local_steps", "impulse", "gravouil_combescure"] = "auto"
    direction: Literal["two_way", "one_way"] = "two_way"
    levels: Literal["auto"] | Annotated[int, Field(ge=1)] = "auto"
    buffer_layers: int = Field(2, ge=2, le=20)

    @field_validator("levels")
    @classmethod
    def _of_local_steps(cls, value: int | str, info: ValidationInfo) -> int | str:
        scheme = info.data.get("scheme", "auto")
        if value != "auto" and scheme not in ("auto", "local_steps", "held_velocity"):
            raise PydanticCustomError("inadmissible", f"cannot be combined with scheme = {scheme}", {"allowed": "auto"})
        return value

    @property
    def most_levels(self) -> int:
        """Largest number of step levels below the window."""
        return MOST_LEVELS if self.levels == "auto" else self.levels


class JointCoupling(Coupling):
    """Coupling of a package on a board; joints that are not fine have the coarse mesh.

    ``fine_joints`` is ``all``, a list of names, or ``critical``: the ``critical_joints`` most stressed joints of a
    coarse run.
    """

    fine_joints: Literal["all", "critical"] | tuple[str, ...] = "all"
    critical_joints: int = Field(3, ge=1)


class Damping(Parameters):
    """Rayleigh damping C = alpha M + beta K, given as coefficients or as ratios of critical damping at a frequency."""

    mass_coefficient: Annotated[float, Quantity("Hz")] = Field(0.0, ge=0)
    stiffness_coefficient: Annotated[float, Quantity("us")] = Field(0.0, ge=0)
    mass_ratio: float = Field(0.0, ge=0, lt=1)
    stiffness_ratio: float = Field(0.0, ge=0, lt=1)
    frequency: Annotated[float | None, Quantity("Hz")] = Field(None, gt=0)

    @property
    def coefficients(self) -> tuple[float, float]:
        """Return alpha [1/s] and beta [s]; a mode of angular frequency w has the ratio alpha / (2 w) + beta w / 2."""
        angular = 2.0 * math.pi * (self.frequency or math.inf)
        by_mass = 2.0 * angular * self.mass_ratio if self.mass_ratio else 0.0
        return self.mass_coefficient + by_mass, self.stiffness_coefficient + 2.0 * self.stiffness_ratio / angular


class BoardDamping(Damping):
    """Damping of a dropped board; ``estimate = auto`` or ``on`` estimates it from the first natural frequency.

    The estimate is a ratio of critical damping 1 / (2 sqrt(f1 / Hz)) of the first mode, proportional to the mass, so
    that the time step is unchanged. ``auto`` takes the damping that a case gives and estimates it otherwise; ``off``
    leaves the board undamped unless the case gives damping.
    """

    estimate: Switch = "auto"

    @property
    def is_given(self) -> bool:
        """Whether there are coefficients or ratios."""
        terms = self.mass_coefficient, self.stiffness_coefficient, self.mass_ratio, self.stiffness_ratio
        return any(terms)

    @property
    def acts(self) -> bool:
        """Whether a drop is damped: the case gives the damping, or it is estimated."""
        return self.is_given or self.estimate != "off"


class ShockNumerics(Parameters):
    """Numerical parameters of the shock.

    ``kinematics`` and ``formulation`` have the meaning they have for a structure. Elastic hexahedra are the same in
    both formulations; plastic hexahedra are two to four times cheaper with ``one_point`` and a few per cent too strong
    in bending. ``kinematics = auto`` is corotational if the predicted deflection of the board requires it.
    ``plasticity = auto`` is on if the predicted stress exceeds half the yield stress of the solder. ``mass_scaled``
    lists roles, such as copper, whose density is raised until they reach the critical step of the other roles, at most
    ``mass_scaled_step``; ``column`` means board and substrate in the columns of fine joints. The added mass is a metric
    with a limit. ``dns_duration`` ends the DNS before the end of the shock; the modes are compared over the time they
    have in common. Implicit steps require elastic materials and are at most the interval between samples.
    """

    modes: tuple[Literal["two_scale", "dns"], ...] = ("two_scale", "dns")
    dns_solver: Literal["explicit", "implicit"] = "explicit"
    dns_duration: Annotated[float | None, Quantity("ms")] = Field(None, gt=0)
    step_fraction: float = Field(0.9, gt=0, le=0.95)
    critical_step: Literal["element", "power_iteration"] = "element"
    kinematics: Literal["auto"] | Kinematics = "auto"
    plasticity: Switch = "auto"
    formulation: Literal["incompatible_modes", "one_point"] = "incompatible_modes"
    mass_scaled: tuple[Literal["board", "substrate", "die", "copper", "solder", "column"], ...] = ()
    mass_scaled_step: Annotated[float | None, Quantity("ns")] = Field(None, gt=0)
    history_samples: int = Field(600, ge=2)
    field_samples: int = Field(12, ge=2)
    energy_balance_limit: float = Field(0.02, gt=0)
    checkpoint_seconds: Annotated[float, Quantity("s")] = Field(60.0, gt=0)
    watchdog_seconds: Annotated[float, Quantity("s")] = Field(60.0, gt=0)

    @field_validator("kinematics")
    @classmethod
    def _fit_the_solver(cls, value: str, info: ValidationInfo) -> str:
        if value in TURNING and info.data.get("dns_solver") == "implicit":
            allowed = "small, or dns_solver = explicit"
            raise PydanticCustomError(
                "inadmissible", "cannot be combined with implicit steps, which are linear", {"allowed": allowed}
            )
        return value

    @property
    def decided_kinematics(self) -> Kinematics:
        """Kinematics of a run.

        Raises:
            ValueError: ``kinematics`` is still ``auto``; the case replaces it before a run.
        """
        if self.kinematics == "auto":
            raise ValueError("shock.numerics.kinematics = auto: the case must decide it before a run")
        return self.kinematics


class Shock(Parameters):
    """Input-G at the mounting holes, package facing down (JESD22-B111; H 4.4).

    The pulse is defined by a JEDEC service condition, by a half sine of ``peak_acceleration`` and ``pulse_duration``,
    or by a table of times and accelerations (CSV; ``table_column`` is the title of one of several columns). ``method``
    applies it as body acceleration of the board with fixed holes, or to a large mass at the holes. ``gravity = auto``
    neglects gravity below a thousandth of the peak. The stress at the upper interface of the joints is written at
    ``picture_times``. ``joint_layer`` is the thickness of the solder at either pad over which stress and plastic work
    are averaged. ``identical_joints`` repeats the shock with a flat package on truncated spheres of the same solder
    volume; the difference is the effect of the joint shapes. ``duration = auto`` ends the shock half a swing of the
    board after the largest stress of its joints, once swings of a damped board have decayed (``output.settled``), at
    the latest one period of the board after the pulse. ``filter`` is applied to accelerations and strain rates.
    ``modes`` is the number of natural frequencies of the board, from the lowest; a quarter model has only the symmetric
    modes.
    """

    service_condition: ServiceCondition | None = None
    peak_acceleration: Annotated[float | None, Quantity("G")] = Field(None, gt=0)
    pulse_duration: Annotated[float | None, Quantity("ms")] = Field(None, gt=0)
    table: str | None = None
    table_column: str | None = None
    duration: Annotated[float, Quantity("ms"), Field(gt=0)] | Literal["auto"]
    picture_times: Annotated[tuple[Annotated[float, Field(ge=0)], ...], Quantity("ms")] = ()
    joint_layer: Annotated[float, Quantity("um")] = Field(JOINT_LAYER, gt=0, le=1e-3)
    identical_joints: bool = False
    modes: int = Field(0, ge=0, le=200)
    method: Literal["direct", "large_mass"] = "direct"
    gravity: Literal["auto", "on", "off"] = "auto"
    damping: BoardDamping = BoardDamping()
    filter: LowPass = LowPass()
    failure: Failure = Failure()
    ranks: Ranks = Ranks()
    coupling: JointCoupling = JointCoupling()
    numerics: ShockNumerics = ShockNumerics()

    @property
    def decided_duration(self) -> float:
        """Duration of a run [s], the longest possible if it is ``auto``.

        Raises:
            ValueError: ``duration`` is still ``auto``; the case replaces it before a run.
        """
        if self.duration == "auto":
            raise ValueError("shock.duration = auto: the case must decide it before a run")
        return self.duration
