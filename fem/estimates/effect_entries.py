"""The effects of heated structures and of shocks as plain data: what each adds, when it matters, where it lives."""

from typing import Any

from reflowshock.fem.estimates.effects import (
    ADDED_MASS_LIMIT,
    NEGLIGIBLE_STIFFENING,
    NEGLIGIBLE_WEIGHT,
    STIFFENING_BOUND,
    STIFFENING_OF_BOARD,
)
from reflowshock.fem.estimates.material_effects import RATE_OF_DROPS
from reflowshock.fem.estimates.thermal_effects import NEGLIGIBLE

Entries = tuple[dict[str, Any], ...]
GIVEN = "none: the case says it"

HEATED: Entries = (
    {
        "name": "thermal",
        "adds": "temperature of board and package in load steps, T(t)",
        "number": GIVEN,
        "influence": "that of flexible",
        "place": "reflowshock.workflow.reflow.forecast.LoadStep",
        "switch": "[thermal], there or not",
        "source": "J-STD-020",
    },
    {
        "name": "flexible",
        "adds": "div C : (eps - alpha dT) = 0 in board and package",
        "number": "bow / standoff or shift of pads / their radius, the larger one",
        "threshold": NEGLIGIBLE,
        "influence": "the number, of the gap or pad",
        "place": "reflowshock.fem.statics.structure.ThermalStructure",
        "switch": "thermal.effects.flexible = auto, on, off",
        "source": "Timoshenko, JOSA 11, 1925, two layers",
    },
    {
        "name": "solder_force",
        "adds": "the joints' wrenches on the plates that bend",
        "number": "(bending under 2 pi a gamma a joint + dents) / standoff",
        "threshold": NEGLIGIBLE,
        "influence": "the number, of the gap",
        "place": "reflowshock.fem.statics.pads.Pads",
        "switch": "thermal.effects.solder_force = auto, on, off",
        "source": "Timoshenko & Woinowsky-Krieger 1959, art. 16",
    },
    {
        "name": "residual_stress",
        "adds": "sigma_0 of cooling, div C : (eps - alpha dT) = 0, as initial state",
        "number": GIVEN,
        "influence": "not predicted: solder at room temperature relaxes",
        "place": "reflowshock.fem.statics.initial_state.InitialState",
        "switch": "thermal.effects.residual_stress = on, off",
        "source": "upper bound, no creep",
    },
)

MATERIALS: Entries = (
    {
        "name": "plasticity",
        "adds": "deps_p = 3/2 dp s / sigma_eq, sigma_eq <= sigma_y(p)",
        "number": "sigma_eq / sigma_y",
        "threshold": 1.0,
        "influence": "none below sigma_y; above it not predicted",
        "place": "reflowshock.fem.forces.force_nonlinear.NonlinearElements",
        "switch": "materials.solder = SAC405 …, or a table with or without plasticity",
        "source": "von Mises; Johnson & Cook 1983",
    },
    {
        "name": "strain_rate",
        "adds": "sigma_y times 1 + C ln max(1, p' / p0')",
        "number": "C",
        "threshold": 0.0,
        "influence": f"C ln(p' / p0') of the yield stress at p' = {RATE_OF_DROPS:g} 1/s",
        "place": "reflowshock.fem.kernels.plasticity.plastic_increment",
        "switch": "materials.*.plasticity.C",
        "source": "Johnson & Cook 1983",
    },
    {
        "name": "thermal_softening",
        "adds": "sigma_y times 1 - T*^m",
        "number": "T*^m",
        "threshold": 0.0,
        "influence": "T*^m of the yield stress",
        "place": "reflowshock.fem.materials.parameters.JohnsonCook",
        "switch": "materials.*.temperature",
        "source": "Johnson & Cook 1983",
    },
)

SHOCK: Entries = (
    {
        "name": "gravity_in_the_shock",
        "adds": "f = M g",
        "number": "g / peak acceleration",
        "threshold": NEGLIGIBLE_WEIGHT,
        "influence": "what g alone deflects the board by, over the deflection of the shock",
        "place": "reflowshock.fem.loads.load.BodyAcceleration",
        "switch": "shock.gravity = auto, on, off",
        "source": "linear in the load",
    },
    {
        "name": "finite_rotation",
        "adds": "F = R U, P = R s U^-1 instead of eps = sym grad u",
        "number": f"1 - w / w0, w0^2 = w^2 + c w^4 / (2 t^2), c = {STIFFENING_BOUND:g}: ends held apart",
        "threshold": NEGLIGIBLE_STIFFENING,
        "influence": f"1 - w / w0 of the deflection, c = {STIFFENING_OF_BOARD:g} of boards on four holes",
        "place": "reflowshock.fem.kernels.nonlinear.Path",
        "switch": "shock.numerics.kinematics = auto, small, finite",
        "source": "Woinowsky-Krieger 1950",
    },
    {
        "name": "damping",
        "adds": "f = -(alpha M + beta K) v",
        "number": "xi omega T, xi = (alpha / omega + beta omega) / 2",
        "influence": "1 - exp(-xi omega T) of the first mode",
        "place": "reflowshock.fem.loads.damping.RayleighDamping",
        "switch": "shock.damping.* of a case, or none",
        "source": "Rayleigh",
    },
    {
        "name": "one_way",
        "adds": "nothing: F_G += N^T F_L is left out, a coarse model drives",
        "number": GIVEN,
        "influence": "not predicted: fine joints' stiffness less the coarse ones', over the board's",
        "place": "reflowshock.fem.coupling.one_way.OneWay",
        "switch": "shock.coupling.direction = two_way, one_way",
        "source": "submodel",
    },
    {
        "name": "coarse_joints",
        "adds": "eight hexahedra a joint instead of the fine mesh",
        "number": GIVEN,
        "influence": "0.1 % of the fine joints' stress (cases/bga_drop, measured)",
        "place": "reflowshock.workflow.board_drop.fine_joints.FineJoints",
        "switch": "shock.coupling.fine_joints = all, critical, names",
        "source": "cases/bga_drop/README.md",
    },
    {
        "name": "identical_joints",
        "adds": "the shock once more, all joints alike",
        "number": GIVEN,
        "influence": "none on the answer: a comparison beside it",
        "place": "reflowshock.workflow.board_drop.identical_joints.identical_sphere",
        "switch": "shock.identical_joints = true, false",
        "source": "truncated spheres",
    },
    {
        "name": "mass_scaling",
        "adds": "rho times (dt_target / dt)^2 in small elements",
        "number": "added mass / mass of the model",
        "threshold": ADDED_MASS_LIMIT,
        "influence": "half of the added share, of frequencies; of its own part more",
        "place": "reflowshock.fem.model.steps.mass_factor",
        "switch": "shock.numerics.mass_scaled = list of roles",
        "source": "Rayleigh quotient",
    },
    {
        "name": "large_mass",
        "adds": "a mass at the holes, pushed: M_L (x'' - a(t)) = 0",
        "number": GIVEN,
        "influence": "none beyond mass of the model / M_L",
        "place": "reflowshock.fem.loads.large_mass.LargeMass",
        "switch": "shock.method = direct, large_mass",
        "source": "H 4.4",
    },
    {
        "name": "symmetry",
        "adds": "u_n = 0 on x = 0 and y = 0: a quarter of the elements",
        "number": GIVEN,
        "influence": "none where model and load are symmetric",
        "place": "reflowshock.fem.mesh.supports.held_components",
        "switch": "board.symmetry = quarter, full",
        "source": "symmetry",
    },
    {
        "name": "failure",
        "adds": "peel stress, von Mises stress and plastic work at each pad against limits",
        "number": "value / limit",
        "threshold": 1.0,
        "influence": "none: joints are judged, not broken",
        "place": "reflowshock.workflow.package.verdict.verdict_of",
        "switch": "shock.failure.*.limit, each with its source, or none",
        "source": "JESD22-B111",
    },
)

ENTRIES: dict[str, Entries] = {"reflow": HEATED[:3], "shock": (*HEATED[3:], *MATERIALS, *SHOCK)}
