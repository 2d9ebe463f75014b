"""Errors and costs of ISPG in every kind of scene.

    PYTHONPATH=. OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 .venv/bin/python benchmarks/ispg_tables.py drops joints
    ... benchmarks/ispg_tables.py --list                       (tables and their rows)
    ... benchmarks/ispg_tables.py drops --only "7," --again    (recompute the rows whose names begin with "7,")

A row is a case of this repository with settings as in ``reflowshock run CASE --set ...``, computed without products.
Each row is stored in results/ispg_tables.json when it is complete and is not computed again unless ``--again`` is
given. All rows take an hour and a half of one core. Times are processor seconds without loading.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

from benchmarks.support import results
from reflowshock.particles.scenes.drop_at_rest import drop_to_rest
from reflowshock.particles.scenes.drop_pair import pair_to_rest
from reflowshock.particles.scenes.free_drop import solve_oscillation
from reflowshock.particles.scenes.joint_at_rest import joint_to_rest
from reflowshock.workflow.case.problems import CaseError
from reflowshock.workflow.pipeline.reader import read_case
from reflowshock.workflow.solder import stages
from reflowshock.workflow.solder.case import DropCase, DropsCase, JointCase, OscillationCase

ROOT = Path(__file__).resolve().parents[1]
NAME = "ispg_tables"
Molten = DropCase | JointCase | DropsCase | OscillationCase


@dataclass(frozen=True, slots=True)
class Row:
    """Case with settings as in the option ``--set``."""

    name: str
    case: str
    settings: tuple[str, ...]


MOVES = ("solder.numerics.scheme=ispg", "solder.effects.inertia=on", "solder.numerics.time_step_limit=100")
PAPER = (*MOVES, "solder.parameters=paper")
SLIP, NO_SLIP = ("solder.wall=slip", "solder.slip_length=0.05 mm"), ("solder.wall=no-slip",)
WALLS = {"free slip": (), "slip": SLIP, "no slip": NO_SLIP}
VOLUMES = (0.0141, 0.0564, 0.1077, 0.1218, 0.2298)  # of example 4.2 [mm^3]
# Acceleration of 1 mm^3 at a Bond number of one, gamma / (rho V^(2/3)) [m/s^2].
HEAVY = 4.985 / (8930.0 * 1e-6)


def drop(count: int, degrees: float, *settings: str, name: str = "") -> Row:
    """Return the row (name, case, settings) of example 4.1, a cube on a wall, at another contact angle and resolution.

    Args:
        count: Number of particles along an edge of the cube.
        degrees: Contact angle [degrees].
        settings: Further settings, as in the option ``--set``.
        name: Words that are appended to the name of the row.
    """
    drop_settings = (f"drop.contact_angle={degrees:g} deg", f"drop.particles_per_edge={count}", *settings)
    return Row(f"{count}, {degrees:g} deg{name and ', '}{name}", "sessile_drop", (*PAPER, *drop_settings))


def heavy(count: int, degrees: float, bond: float, *settings: str) -> Row:
    """Return the row of a cube on a wall that spreads under its weight; see ``drop`` for the common arguments.

    Args:
        count: Number of particles along an edge of the cube.
        degrees: Contact angle [degrees].
        bond: Bond number, weight over surface tension.
        settings: Further settings, as in the option ``--set``.
    """
    weight = ("gravity=on", f"solder.gravity={bond * HEAVY:.6g} m/s^2")
    return drop(count, degrees, *weight, *settings, name=f"Bond number {bond:g}")


def between(count: int, receding: float, advancing: float, wall: str = "free slip", symmetry: str = "none") -> Row:
    """Return the row of a cube on a wall with contact angle hysteresis.

    Args:
        count: Number of particles along an edge of the cube.
        receding: Receding contact angle [degrees].
        advancing: Advancing contact angle [degrees].
        wall: Wall condition, a key of ``WALLS``, e.g. "free slip".
        symmetry: Planes of symmetry: "none", "half" or "quarter".
    """
    angles = f"receding_angle='{receding:g} deg',advancing_angle='{advancing:g} deg'"
    table = f"drop={{volume='1 mm^3',{angles},particles_per_edge={count},symmetry='{symmetry}'}}"
    name = f"{count}, {receding:g} to {advancing:g} deg, {wall}" + (f", {symmetry}" if symmetry != "none" else "")
    return Row(name, "sessile_drop", (*PAPER, *WALLS[wall], table))


def ball(volume: float, count: int, wall: str = "free slip") -> Row:
    """Return the row of example 4.2, a drop on a pad, at another resolution.

    Args:
        volume: Volume [mm^3].
        count: Number of particles along an edge of the initial cube.
        wall: Wall condition, a key of ``WALLS``, e.g. "free slip".
    """
    ball_settings = (f"drop.volume={volume} mm^3", f"drop.particles_per_edge={count}", *WALLS[wall])
    return Row(f"{count}, {volume} mm^3, {wall}", "bga_ball", (*PAPER, *ball_settings))


def joint(spacing: float, name: str, *settings: str) -> Row:
    """Return the row of the solder joint case with other settings.

    Args:
        spacing: Particle spacing [mm].
        name: Words for the name of the row.
        settings: Further settings, as in the option ``--set``.
    """
    return Row(f"{spacing} mm, {name}", "solder_joint", (*PAPER, f"joint.spacing={spacing} mm", *settings))


def standing(spacing: float, standoff: float) -> Row:
    """Return the row of a joint between fixed plates, from particle spacing and standoff [mm]."""
    return joint(spacing, f"{standoff:.2f} mm", f"joint.standoff={standoff} mm")


def floating(free: str, *settings: str) -> Row:
    """Return the row of a package that floats on one joint under a load of 1 mN.

    Args:
        free: Free directions, separated by ", ", e.g. "lift, shift".
        settings: Further settings, as in the option ``--set``.
    """
    return joint(0.06, free, f"joint.package={{load='1 mN',free={json.dumps(free.split(', '))}}}", *settings)


def pulled(spacing: float, speed: float) -> Row:
    """Return the row of a package that is pulled off, from particle spacing [mm] and speed [mm/s]."""
    return joint(spacing, f"{speed:g} mm/s", f"joint.path={{standoff='1.2 mm',speed='{speed:g} mm/s'}}")


def swing(shells: int, steps: int) -> Row:
    """Return the row of a free drop of real solder that oscillates with an amplitude of 0.1 R over two periods.

    Args:
        shells: Number of shells of particles in the ball.
        steps: Number of time steps per period.
    """
    count = 1 + sum(10 * shell**2 + 2 for shell in range(1, shells + 1))
    oscillation_settings = (f"oscillation.particles_per_radius={shells}", f"oscillation.steps_per_period={steps}")
    return Row(
        f"{count}, {steps} steps a period", "oscillating_drop", ("oscillation.scheme=ispg", *oscillation_settings)
    )


def section(count: int, degrees: float, bond: float = 0.0) -> Row:
    """Return the row of an axisymmetric drop computed in section.

    Args:
        count: Number of particles along an edge.
        degrees: Contact angle [degrees].
        bond: Bond number; 0 without weight.
    """
    cut = "drop.section=axisymmetric"
    return heavy(count, degrees, bond, cut) if bond else drop(count, degrees, cut)


def ridge(count: int, degrees: float) -> Row:
    """Return the row of a drop that is uniform along y, from particles per edge and contact angle [degrees]."""
    return drop(count, degrees, "drop.section=plane")


def real(count: int) -> Row:
    """Return the row of example 4.1 with real solder and inertia at 60 degrees, from the particles per edge."""
    drop_settings = ("drop.contact_angle=60 deg", f"drop.particles_per_edge={count}")
    return Row(f"{count}, 60 deg", "sessile_drop", (*MOVES[:2], *drop_settings))


def merging(spacing: float, on_wall: bool) -> Row:
    """Return the row of drops of 0.5 and 0.25 mm^3 that merge, on a wall or free, from the particle spacing [mm]."""
    wall = ("drops.contact_angle=60 deg", "drops.distance=1.3 mm") if on_wall else ()
    name = f"{spacing:.2f} mm, {'60 deg' if on_wall else 'free'}"
    return Row(name, "coalescence", (*PAPER, "gravity=off", f"drops.spacing={spacing} mm", *wall))


TABLES: dict[str, list[Row]] = {
    "drops": [drop(count, angle) for count in (5, 7, 9, 11, 13, 15) for angle in (60, 120)]
    + [drop(count, angle) for count in (7, 11) for angle in (30, 148)],
    "films": [drop(count, angle) for count in (5, 7) for angle in (20, 15)],
    "free": [
        Row(str(count), "sessile_drop", (*PAPER, f"drop={{volume='1 mm^3',particles_per_edge={count}}}"))
        for count in (7, 9, 11)
    ],
    # The largest cube with 7 particles per edge is too coarse for its pad.
    "pads": [ball(volume, 7) for volume in VOLUMES[:-1]]
    + [ball(volume, 11) for volume in VOLUMES]
    + [ball(VOLUMES[-1], 9), ball(VOLUMES[-1], 9, "no slip")]
    + [ball(0.0564, 7, "no slip"), ball(0.0141, 7, "slip"), ball(0.1077, 7, "slip")],
    "joints": [standing(0.04, standoff) for standoff in (0.30, 0.35, 0.40, 0.45, 0.50)]
    + [
        joint(0.04, "offset 0.07 mm", "joint.offset=0.07 mm"),
        joint(0.06, "tilt 3 deg", "joint.tilt=3 deg"),
        joint(0.06, "0.30 mm, tilt 5 deg", "joint.standoff=0.3 mm", "joint.tilt=5 deg"),
        joint(0.06, "no slip", *NO_SLIP),
        standing(0.06, 0.22),
    ],
    "floating": [
        floating("lift"),
        floating("lift, shift", "joint.offset=0.072 mm"),
        floating("lift, turn", "joint.tilt=3 deg"),
    ],
    "pulled": [pulled(0.06, 1000), pulled(0.06, 200), pulled(0.04, 200), pulled(0.06, 20)],
    "weight": [heavy(7, 60, 5), heavy(7, 120, 1), heavy(5, 60, 5), heavy(11, 60, 1)],
    "friction": [
        drop(count, angle, *WALLS[wall], name=wall)
        for count in (7, 6, 11, 12)
        for angle in (60, 120)
        for wall in ("slip", "no slip")
    ],
    "symmetry": [
        drop(7, 60, "drop.symmetry=half", name="half"),
        drop(7, 60, "drop.symmetry=quarter", name="quarter"),
        drop(7, 120, "drop.symmetry=half", name="half"),
        drop(7, 60, "drop.symmetry=quarter", *SLIP, name="quarter, slip"),
        drop(11, 60, "drop.symmetry=quarter", name="quarter"),
    ],
    "hysteresis": [
        *(between(count, *angles) for count in (6, 7) for angles in ((30, 60), (60, 120), (100, 130))),
        between(7, 60, 120, symmetry="quarter"),
        between(7, 60, 120, "slip"),
        between(7, 30, 60, "no slip"),
        between(9, 60, 120),
    ],
    "section": [section(count, angle) for count in (11, 21) for angle in (60, 120)]
    + [section(11, 30), section(11, 148), section(11, 60, bond=5)],
    "plane": [ridge(count, angle) for count in (8, 11) for angle in (60, 120)] + [ridge(11, 148), ridge(21, 60)],
    "swings": [swing(shells, 30) for shells in (3, 4, 5, 6, 7, 8)] + [swing(shells, 100) for shells in (4, 6)],
    "impact": [
        drop(count, 90, "drop.speed=4.74 m/s", *NO_SLIP, name="4.74 m/s") for count in (7, 9)
    ],
    "merging": [merging(0.15, True), merging(0.15, False), merging(0.13, True), merging(0.1, False)],
    "real": [real(count) for count in (5, 7, 11)],
}  # fmt: skip
# Printed columns: metric, heading, factor, format.
COLUMNS = (
    ("particles", "particles", 1.0, "{:.0f}"),
    ("height_error", "height", 100.0, "{:+.2f} %"),
    ("max_width_error", "width", 100.0, "{:+.2f} %"),
    ("shape_error", "shape", 100.0, "{:.3f} %"),
    ("waist_error", "waist", 100.0, "{:+.3f} %"),
    ("axial_force_error", "force", 100.0, "{:+.2f} %"),
    ("time_at_rest", "at rest after", 1e3, "{:.1f} ms"),
    ("steps", "steps", 1.0, "{:.0f}"),
    ("volume_drift", "volume", 1.0, "{:.0e}"),
    ("energy_imbalance", "imbalance", 100.0, "{:+.5f} %"),
    ("period_error", "period", 100.0, "{:+.1f} %"),
    ("decay_rate_error", "decay", 100.0, "{:+.0f} %"),
    ("core_seconds", "core-s", 1.0, "{:.1f}"),
)


def compute_and_judge(case: Molten) -> tuple[dict[str, tuple[float, str]], dict[str, dict]]:
    """Compute a case and judge its results.

    Returns:
        Metric name -> value and unit, and check name -> result of a health check, with the key ``ok``.
    """
    match case:
        case DropCase():
            solution = drop_to_rest(case.drop, case.molten)
            findings = stages.judge_drop(solution.shape.metrics, solution.shape.verdict, solution.effects)
        case JointCase():
            solution = joint_to_rest(case.joint, case.molten)
            findings = stages.judge_joint(solution.shape.metrics, solution.shape.verdict, solution.effects)
        case DropsCase():
            solution = pair_to_rest(case.drops, case.molten)
            findings = stages.judge_drops(solution.shape.metrics, 1, solution.effects)
        case OscillationCase():
            solution = solve_oscillation(case.oscillation, case.molten)
            findings = stages.judge_oscillation(solution.metrics, {})
    return findings.metrics, findings.health


def compute(row: Row) -> dict[str, Any]:
    """Compute the case of a row.

    Returns:
        Metrics by name in SI units, ``core_seconds``, and names of the failed health checks, ``unmet``; ``error``, its
        message, and ``core_seconds`` if the case is refused or fails.
    """
    begin = process_time()
    try:
        metrics, health = compute_and_judge(read_case(ROOT / "cases" / row.case / "case.toml", row.settings))
    except (CaseError, RuntimeError) as error:  # a refusal or a failed solution is a result as well
        return {"error": f"{type(error).__name__}: {error}", "core_seconds": process_time() - begin}
    figures: dict[str, Any] = {name: metric["value"] for name, metric in metrics.items()}
    unmet = [name for name, check in health.items() if not check["ok"]]
    return figures | {"core_seconds": process_time() - begin, "unmet": unmet}


def format_row(name: str, figures: dict[str, Any]) -> str:
    """Format a row for the terminal.

    Args:
        name: Name of the row.
        figures: Figures of ``compute``.
    """
    if "error" in figures:
        return f"| {name} | {figures['error'][:120]} ({figures['core_seconds']:.0f} core-s)"
    cells = [f"{head} {text.format(factor * figures[key])}" for key, head, factor, text in COLUMNS if key in figures]
    return f"| {name} | " + " | ".join(cells) + (f" | FAILED: {figures['unmet']}" if figures["unmet"] else "")


def warm_up() -> None:
    """Load and compile the code that most rows share."""
    compute(drop(5, 60, "solder.numerics.max_steps=3"))


def main() -> None:
    """Compute the selected rows that are not stored."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"tables among {', '.join(TABLES)} (default: all)")
    parser.add_argument("--only", default="", metavar="BEGINNING", help="select rows by the beginning of their names")
    parser.add_argument("--again", action="store_true", help="recompute stored rows")
    parser.add_argument("--list", action="store_true", help="list the tables and their rows without computing")
    options = parser.parse_args()
    unknown = set(options.tables) - set(TABLES)
    if unknown:
        parser.error(f"unknown table {', '.join(sorted(unknown))}; available: {', '.join(TABLES)}")
    stored = results.read_figures(NAME)
    is_warm = options.list
    for table in options.tables or TABLES:
        print(table, flush=True)
        rows = stored.setdefault(table, {})
        for row in (row for row in TABLES[table] if row.name.startswith(options.only)):
            if (row.name not in rows or options.again) and not options.list:
                if not is_warm:
                    warm_up()
                    is_warm = True
                rows[row.name] = compute(row)
                results.write_figures(NAME, stored)
            print(format_row(row.name, rows[row.name]) if row.name in rows else f"| {row.name} |", flush=True)


if __name__ == "__main__":
    main()
