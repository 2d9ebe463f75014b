"""Effects of a board drop, decided from dimensionless numbers, for plans and runs; ``DROP_EFFECTS`` lists them all."""

import math
from collections.abc import Mapping
from typing import Any

from reflowshock.effect import Decision, Switch, Toggle, decision
from reflowshock.fem.estimates.board_damping import BoardDampingEffect
from reflowshock.fem.estimates.drop_effect import Drop, DropEffect, DropRun
from reflowshock.fem.estimates.material_effects import (
    OF_YIELD_STRESS,
    MaterialEffect,
    Plasticity,
    plastic_laws,
    yields,
)
from reflowshock.fem.problem.failure import Failure
from reflowshock.fem.problem.kinematics import Kinematics, finite_rotation
from reflowshock.materials.library import SAC405
from reflowshock.materials.parameters import Material
from reflowshock.parameters import with_value

NEGLIGIBLE_WEIGHT = 1e-3  # g over the peak acceleration below which gravity is neglected
# Strip between immovable ends: the restoring force at the deflection w is k w (1 + 3 (w / t)^2), because the tension
# N = E A / (4 L^2) (pi w)^2 adds N (pi / L)^2 to the bending stiffness (Woinowsky-Krieger, J. Appl. Mech. 17, 1950).
STIFFENING_BOUND = 3.0
# The same coefficient for boards held at four holes, whose edges draw in. Runs gave 0.11 (cases/jedec_board, deflection
# 5.0 instead of 7.7 thicknesses), 0.35 (bare board of cases/bga_drop, 4.8 instead of 10.9) and 0.73 (the same at 150 G,
# 0.95 instead of 1.09), so the predicted change is right within a factor of two.
STIFFENING_OF_BOARD = 0.35
NEGLIGIBLE_STIFFENING = 1e-2  # relative change of the deflection, by the bound
YIELDS_FROM = 0.5  # peel stress at a pad over the yield stress; the von Mises stress is up to 1.6 times higher
ADDED_MASS_LIMIT = 0.05  # mass added by mass scaling over the mass of the model


class WeightEffect(DropEffect):
    """Gravity during the shock."""

    name = "gravity_in_the_shock"
    adds = "f = M g"
    number = "g / peak acceleration"
    threshold = NEGLIGIBLE_WEIGHT
    influence = "static deflection of the board under g, over the deflection by the shock"
    implementation = "reflowshock.fem.loads.load.BodyAcceleration"
    switch = "shock.gravity = auto, on, off"
    source = "linear in the load"

    @staticmethod
    def by_peak(switch: Switch, peak: float, gravity: float) -> Decision:
        """Decide on gravity in a shock by its switch, or else by g over the peak acceleration, both in [m/s^2]."""
        ratio = gravity / peak if peak > 0.0 else math.inf
        reason = f"1 G is {ratio:.3g} of the peak acceleration"
        if switch != "auto":
            return decision(switch == "on", f"shock.gravity = {switch}; {reason}", min(ratio, 1.0))
        on = ratio >= NEGLIGIBLE_WEIGHT
        return decision(on, f"{reason}, {'at least' if on else 'below'} {NEGLIGIBLE_WEIGHT:g}", min(ratio, 1.0))

    def decide(self, drop: Drop) -> Decision:
        """Return the decision on gravity, with its static deflection over the largest deflection as influence.

        Gravity lasts longer than the pulse, so a board whose period is long against the pulse responds to gravity more
        than g over the peak acceleration suggests.
        """
        largest = drop.expected.largest
        influence = min(1.0, drop.bent_by_weight / largest) if largest > 0.0 else 1.0
        return decision(drop.weight["on"], drop.weight["why"], influence)

    def report(self, run: DropRun) -> Decision:
        """Return the decision of the plan."""
        return run.weight


def stiffened(ratio: float, coefficient: float) -> float:
    """Return the relative reduction of a deflection by membrane stiffening, 1 - w / w0.

    The same energy bends a linear plate by w0 and a stiffening plate by w: w0^2 = w^2 + c w^4 / (2 t^2).

    Args:
        ratio: Linear deflection over thickness, w0 / t.
        coefficient: Stiffening coefficient c.
    """
    if ratio == 0.0:
        return 0.0
    share = 0.5 * coefficient * ratio**2
    return 1.0 - math.sqrt(2.0 / (1.0 + math.sqrt(1.0 + 4.0 * share)))


def called_for(ratio: float, cooled: bool) -> tuple[Kinematics, str]:
    """Return the kinematics that a deflection calls for, and the reason as text.

    Args:
        ratio: Deflection of the board over its thickness.
        cooled: Whether the shock begins with residual stress, which requires path-dependent elements at finite
            rotations.

    Returns:
        "small" if stretching of the board changes deflections by a negligible amount; otherwise "finite" with residual
        stress and "corotational" without it.
    """
    bound = stiffened(ratio, STIFFENING_BOUND)
    turns = bound > NEGLIGIBLE_STIFFENING
    relation = f"{'>' if turns else '<='} {100.0 * NEGLIGIBLE_STIFFENING:g} %"
    why = f"stretching changes deflections by up to {100.0 * bound:.3g} % ({relation})"
    if not turns:
        return "small", why
    return ("finite", f"{why}; residual stress needs path-dependent elements") if cooled else ("corotational", why)


class FiniteRotation(DropEffect):
    """Finite rotations, which include the membrane stiffening of a bent board."""

    name = "finite_rotation"
    adds = "F = R U, P = R s U^-1 instead of eps = sym grad u"
    number = f"1 - w / w0, w0^2 = w^2 + c w^4 / (2 t^2), c = {STIFFENING_BOUND:g}: immovable ends"
    threshold = NEGLIGIBLE_STIFFENING
    influence = f"1 - w / w0 of the deflection, c = {STIFFENING_OF_BOARD:g} of boards on four holes"
    implementation = "reflowshock.fem.kernels.nonlinear.Path"
    switch = "shock.numerics.kinematics = auto, small, corotational, finite"
    source = "Woinowsky-Krieger 1950"
    toggle = Toggle("shock.numerics.kinematics", "corotational", "small")

    def decide(self, drop: Drop) -> Decision:
        """Decide by the expected deflection over the thickness."""
        kinematics, ratio = drop.shock.numerics.kinematics, drop.expected.largest / drop.thickness
        required, reason = called_for(ratio, drop.cooled)
        chosen = required if kinematics == "auto" else kinematics
        finite, why = finite_rotation("shock.numerics", chosen, 0.5 * drop.expected.slope**2)
        if kinematics == "auto":
            why = f"shock.numerics.kinematics = auto: {reason}"
        elif not finite:
            why += "" if required == "small" else f"; auto would choose {required}"
        why = f"the board is expected to deflect by about {ratio:.3g} times its thickness; {why}"
        return decision(finite, why, stiffened(ratio, STIFFENING_OF_BOARD))

    def report(self, run: DropRun) -> Decision:
        """Return the kinematics of the run with the strain that they neglect."""
        kinematics = run.shock.numerics.decided_kinematics
        return decision(*finite_rotation("shock.numerics", kinematics, run.neglected_strain))


class SolderPlasticity(DropEffect):
    """Plasticity of the solder."""

    name, adds, source = Plasticity.name, Plasticity.adds, Plasticity.source
    implementation = Plasticity.implementation
    number = "expected peel stress / sigma_y, peel = K sqrt(k E t^3 / 12) pitch^2 / A, board bent by K on springs k"
    threshold = YIELDS_FROM
    influence = Plasticity.influence
    switch = "shock.numerics.plasticity = auto, on, off; materials.solder = SAC405 …"

    @staticmethod
    def called_for(switch: Switch, materials: Mapping[str, Material], stress: float, cooled: bool) -> Decision:
        """Decide on plasticity of the solder.

        Args:
            switch: Value of ``shock.numerics.plasticity``.
            materials: Materials by role.
            stress: Expected peel stress [Pa].
            cooled: Whether the shock begins with the residual stress of cooling.
        """
        law = materials["solder"].plasticity
        if law is None:
            return decision(False, "the solder is elastic")
        reason = f"shock.numerics.plasticity = {switch}; {yields('solder', law)}"
        if switch != "auto":
            return decision(switch == "on", reason)
        ratio = stress / law.A
        reason += f"; a peel stress of {1e-6 * stress:.3g} MPa is expected, {ratio:.3g} of that"
        if cooled:
            return decision(True, f"{reason}; it yields while it cools")
        on = ratio >= YIELDS_FROM
        return decision(on, f"{reason}, {'at least' if on else 'below'} {YIELDS_FROM:g}")

    def decide(self, drop: Drop) -> Decision:
        """Decide by the expected peel stress."""
        return drop.yielding

    def report(self, run: DropRun) -> Decision:
        """Return the plastic materials of the run."""
        laws = plastic_laws(run.materials)
        why = f"shock.numerics.plasticity = {run.shock.numerics.plasticity}"
        return decision(bool(laws), "; ".join([why, *(yields(name, law) for name, law in laws.items())]))

    def toggled(self, case: Any, acts: bool) -> Any:
        """Return the case of a package with elastic solder if it is plastic, else with plastic solder."""
        with_law = case if acts or case.materials.solder.plasticity else with_value(case, "materials.solder", SAC405)
        return with_value(with_law, "shock.numerics.plasticity", "off" if acts else "on")


class Failing(DropEffect):
    """Failure criteria of joints and board."""

    name = "failure"
    adds = "loads of joints and board against limits or a reference design"
    number = "value / limit"
    threshold = 1.0
    influence = "none: joints are judged, not broken"
    implementation = "reflowshock.workflow.verdict.verdict.verdict_of"
    switch = (
        "shock.failure.*.limit, each with its source; shock.failure.board_deflection.apply; shock.failure.reference"
    )
    source = "JESD22-B111"

    @staticmethod
    def by_limits(failure: Failure) -> Decision:
        """Decide whether failure is assessed: if any criterion is on. Assessment changes no result."""
        why = "judges " + ", ".join(name.replace("_", " ") for name in failure.judged)
        none = "shock.failure gives no limit, and shock.failure.board_deflection.apply = off"
        return decision(bool(failure.judged), why if failure.judged else none, 0.0)

    def decide(self, drop: Drop) -> Decision:
        """Decide by the criteria of the case."""
        return self.by_limits(drop.shock.failure)


class DrivenJoints(DropEffect):
    """One-way coupling: a coarse model drives the joints without feedback."""

    name = "one_way"
    adds = "nothing: F_G += N^T F_L is left out, a coarse model drives"
    influence = "not predicted: fine joints' stiffness less the coarse ones', over the board's"
    implementation = "reflowshock.fem.coupling.one_way.OneWay"
    switch = "shock.coupling.direction = two_way, one_way"
    source = "submodel"
    toggle = Toggle("shock.coupling.direction", "one_way", "two_way")

    def decide(self, drop: Drop) -> Decision:
        """Decide by the coupling of the case, for two models."""
        coupled = "two_scale" in drop.shock.numerics.modes
        one_way = coupled and drop.shock.coupling.direction == "one_way"
        why = f"shock.coupling.direction = {drop.shock.coupling.direction}" if coupled else "one model"
        return decision(one_way, why, None if one_way else 0.0)


class MassScaling(DropEffect):
    """Mass scaling: mass added to small elements for a longer time step."""

    name = "mass_scaling"
    adds = "rho times (dt_target / dt)^2 in small elements"
    number = "added mass / mass of the model"
    threshold = ADDED_MASS_LIMIT
    influence = "about half the relative added mass in frequencies, more in the scaled part"
    implementation = "reflowshock.fem.model.steps.mass_factor"
    switch = "shock.numerics.mass_scaled = list of roles"
    source = "Rayleigh quotient"
    toggle = Toggle("shock.numerics.mass_scaled", ("copper",), ())

    def decide(self, drop: Drop) -> Decision:
        """Decide by the setting of the case."""
        scaled = drop.shock.numerics.mass_scaled
        return decision(bool(scaled), f"shock.numerics.mass_scaled = {list(scaled)}")

    def report(self, run: DropRun) -> Decision:
        """Return the added mass."""
        why = f"shock.numerics.mass_scaled = {list(run.shock.numerics.mass_scaled)}; adds {run.added_mass:.3e} kg"
        return decision(run.added_mass > 0.0, why)


class ByLargeMass(DropEffect):
    """Input-G by a large mass at the mounting holes."""

    name = "large_mass"
    adds = "an accelerated mass at the holes: M_L (x'' - a(t)) = 0"
    influence = "none beyond mass of the model / M_L"
    implementation = "reflowshock.fem.loads.large_mass.LargeMass"
    switch = "shock.method = direct, large_mass"
    source = "H 4.4"

    def decide(self, drop: Drop) -> Decision:
        """Decide by the setting of the case."""
        return decision(drop.shock.method == "large_mass", f"shock.method = {drop.shock.method}", 0.0)


class Symmetry(DropEffect):
    """Symmetry: a quarter of the board instead of the whole."""

    name = "symmetry"
    adds = "u_n = 0 on x = 0 and y = 0: a quarter of the elements"
    influence = "none where model and load are symmetric"
    implementation = "reflowshock.fem.mesh.supports.held_components"
    switch = "board.symmetry = quarter, full"
    source = "symmetry"

    def decide(self, drop: Drop) -> Decision:
        """Decide by the setting of the case."""
        return decision(drop.symmetry == "quarter", f"board.symmetry = {drop.symmetry}", 0.0)


DROP_EFFECTS: tuple[DropEffect | MaterialEffect, ...] = (
    WeightEffect(),
    FiniteRotation(),
    BoardDampingEffect(),
    SolderPlasticity(),
    *OF_YIELD_STRESS,
    Failing(),
    DrivenJoints(),
    MassScaling(),
    ByLargeMass(),
    Symmetry(),
)


def reported_effects(run: DropRun) -> dict[str, Decision]:
    """Return the decisions on all effects of a completed drop by name; effects without a decision are left out.

    Args:
        run: Shock, materials and measures of the run.

    Returns:
        Effect name -> whether it is on, the reason as text and, if known, its relative influence on the result;
        ``gravity_in_the_shock`` is called ``gravity``.
    """
    decisions = {effect.name.removesuffix("_in_the_shock"): effect.report(run) for effect in DROP_EFFECTS}
    return {name: decision for name, decision in decisions.items() if decision is not None}
