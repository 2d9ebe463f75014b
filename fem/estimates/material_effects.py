"""Which effects the materials of a run call for, and why. Plain Python, for ``plan`` and for the run itself."""

from collections.abc import Mapping
from math import log
from typing import Any

from reflowshock.fem.materials.parameters import Isotropic, JohnsonCook, Material
from reflowshock.fem.problem.failure import Failure

RATE_OF_DROPS = 100.0  # [1/s] of solder: cases/bga_drop finds up to 50


def material_effects(materials: Mapping[str, Material]) -> dict[str, dict[str, Any]]:
    """Decide on plasticity, its rate and temperature dependence.

    Args:
        materials: Part or role -> its material.

    Returns:
        Effect -> on, why.
    """
    laws = plastic_laws(materials)
    if not laws:
        why = "all materials are elastic"
        return {name: {"on": False, "why": why} for name in ("plasticity", "strain_rate", "thermal_softening")}
    raised = max((law.C * log(RATE_OF_DROPS / law.reference_rate) for law in laws.values()), default=0.0)
    fast = {name: law for name, law in laws.items() if law.C > 0.0}
    soft = {
        name: item.softening for name, item in materials.items() if isinstance(item, Isotropic) and item.softening < 1.0
    }
    return {
        "plasticity": {"on": True, "why": "; ".join(yields(name, law) for name, law in laws.items())},
        "strain_rate": {
            "on": bool(fast),
            "why": "; ".join(
                f"{name}: C = {law.C:g} above {law.reference_rate:g} 1/s at which A and B are measured"
                for name, law in fast.items()
            )
            or "C = 0: no dependence given",
            "influence": max(raised, 0.0),
        },
        "thermal_softening": {
            "on": bool(soft),
            "why": "; ".join(f"{name}: yield stress times {factor:.3g}" for name, factor in soft.items())
            or "at the temperature at which A and B are measured",
            "influence": 1.0 - min(soft.values(), default=1.0),
        },
    }


def plastic_laws(materials: Mapping[str, Material]) -> dict[str, JohnsonCook]:
    """Return the yield stress of the materials that have one, by name."""
    return {name: material.plasticity for name, material in materials.items() if material.plasticity is not None}


def yields(name: str, law: JohnsonCook) -> str:
    """Say when a material yields."""
    hardening = f", hardening {1e-6 * law.B:g} MPa p^{law.n:g}" if law.B > 0.0 else ", no hardening"
    return f"{name} yields from {1e-6 * law.A:g} MPa on{hardening}"


def failure_effect(failure: Failure) -> dict[str, dict[str, Any]]:
    """Decide whether joints are judged: where a measure has a limit. Judging changes no result."""
    why = "limits of " + " and ".join(name.replace("_", " ") for name in failure.limits)
    on = bool(failure.limits)
    return {"failure": {"on": on, "why": why if on else "shock.failure gives no limit", "influence": 0.0}}
