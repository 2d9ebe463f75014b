"""Stability of every coupling scheme: growth of one window over a grid of model pairs, long runs, and momentum.

    PYTHONPATH=. python benchmarks/coupling_stability.py [--quick]  (half an hour, one core)

A block is tied to a board of orthotropic FR4 off its grid: m from 1 to 40, impedance ratios from 0.1 to 10, mesh ratios
from 1 to 8, flat, distorted and curved interfaces, below the block or next to it. The amplification matrix of one
window is assembled from the program's own operators at the program's own steps, with step fractions 0.9 and 0.95 (the
largest allowed). Its spectral radius must be at most 1 + 1e-8. The scheme as printed in the paper (fine elements at the
interface, internal force only, no interface mass) is in the same table.
"""

import argparse
import json
import os
from collections.abc import Iterator
from itertools import product

os.environ["OMP_NUM_THREADS"] = os.environ["NUMBA_NUM_THREADS"] = "1"

from benchmarks.support import results, turns
from reflowshock.cases.hard.trials.pairs import SCHEMES, Pair
from reflowshock.cases.hard.trials.windows import PUSH, momentum_error
from tests.stability.test_fem_window_grid import GROWTH

PRINTED = "as printed"
RATIOS = (1.0, 1.5, 8 / 3, 4.0, 8.0)
LONG, SAMPLES = 100_000, 1000
LARGEST_FRACTION = 0.95
DRIFT, MOMENTUM = 1e-3, 1e-10


def sample_grid() -> Iterator[tuple[Pair, float]]:
    """Yield the samples: a pair of coupled models, and the time step over the critical step of its elements."""
    for substeps, impedance, ratio in product((1, 2, 3, 5, 8, 13, 24, 40), (0.1, 0.3, 1.0, 3.0, 10.0), RATIOS):
        yield Pair(substeps, impedance, ratio), 0.9
    for shape, substeps, impedance, ratio in product(("distorted", "curved"), (2, 12, 40), (0.1, 1.0, 10.0), RATIOS):
        yield Pair(substeps, impedance, ratio, shape), 0.9
    for substeps, impedance, ratio in product((3, 13, 40), (0.1, 1.0, 10.0), (4.0, 8.0)):
        yield Pair(substeps, impedance, ratio, columns=4), LARGEST_FRACTION
    for substeps, impedance, thinnest in product((2, 6), (0.1, 1.0, 10.0), (0.1, 0.3)):
        yield Pair(substeps, impedance, 2.0, height=3, thinnest=thinnest), LARGEST_FRACTION


def measure_growths(pair: Pair, fraction: float) -> dict[str, float]:
    """Return scheme -> growth of a window (the interval between two exchanges): its spectral radius minus 1.

    Args:
        pair: Macro and meso model: substeps, impedance ratio, shape.
        fraction: Time step over the critical step.
    """
    finer = pair.substeps > 1  # otherwise local steps equal the window
    chosen = {name: coupling for name, coupling in SCHEMES.items() if finer or coupling.scheme != "local_steps"}
    made = {name: pair.coupled(coupling, fraction) for name, coupling in chosen.items()}
    made[PRINTED] = pair.printed(fraction)
    return {name: coupled.spectral_radius() - 1.0 for name, coupled in made.items()}


def summarise_growths(rows: list[dict]) -> dict[str, dict]:
    """Summarise the growths of every scheme.

    Args:
        rows: Rows with ``pair`` (text), ``fraction`` and ``growth`` (scheme -> growth of a window).

    Returns:
        Scheme -> number of ``samples``, number of ``unstable`` ones, largest growth ``worst``, and the pair ``where``
        it occurs.
    """
    result = {}
    for name in (*SCHEMES, PRINTED):
        growth_of_pair = {row["pair"]: row["growth"][name] for row in rows if name in row["growth"]}
        worst = max(growth_of_pair, key=lambda pair: growth_of_pair[pair])
        unstable = sum(value > GROWTH for value in growth_of_pair.values())
        result[name] = {
            "samples": len(growth_of_pair),
            "unstable": unstable,
            "worst": growth_of_pair[worst],
            "where": worst,
        }
    return result


def judge_growths(result: dict) -> dict[str, dict]:
    """Compare growths, energy drifts and momentum errors with their limits.

    Args:
        result: ``schemes`` (of ``summarise_growths``), ``long_runs`` (of ``run_long``) and ``momentum_error`` by
            scheme.

    Returns:
        Name of a limit -> value, limit, sense of the comparison and whether it is satisfied, as ``turns.bar`` returns
        it.
    """
    schemes, momentum_errors = result["schemes"], result["momentum_error"]
    bars = {f"growth of a window, {name}": turns.bar(schemes[name]["worst"], GROWTH, False) for name in SCHEMES}
    bars[f"growth of a window, {PRINTED}"] = turns.bar(schemes[PRINTED]["worst"], GROWTH)
    for name, run in result["long_runs"].items():
        bars[f"energy drift, {name}, {run['windows']} windows"] = turns.bar(run["energy_drift"], DRIFT, False)
    return bars | {f"momentum, {name}": turns.bar(value, MOMENTUM, False) for name, value in momentum_errors.items()}


def run_long(windows: int) -> dict[str, dict]:
    """Run a pair of models for many windows after an undamped push.

    Args:
        windows: Number of windows, the intervals between two exchanges.

    Returns:
        Scheme -> ``windows``, ``energy_drift`` and ``largest_interface_energy``, relative to the total energy.
    """
    result = {}
    for name in ("held_velocity", "impulse", "local_steps"):
        coupled = Pair(3, 3.0, 2, layers=3).coupled(SCHEMES[name])
        coupled.swing(PUSH)
        drift, interface = coupled.drift(windows, SAMPLES)
        result[name] = {"windows": windows, "energy_drift": drift, "largest_interface_energy": interface}
    return result


def main() -> None:
    """Run all measurements and store the results."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="take every twentieth pair and 1e4 windows")
    quick = parser.parse_args().quick
    rows = []
    for pair, fraction in list(sample_grid())[:: 20 if quick else 1]:
        rows.append({"pair": repr(pair), "fraction": fraction, "growth": measure_growths(pair, fraction)})
        print(len(rows), rows[-1]["pair"], {name: f"{value:.1e}" for name, value in rows[-1]["growth"].items()})
    momentum = {name: momentum_error(coupling, 0.9) for name, coupling in SCHEMES.items()}
    result = {"limit": GROWTH, "schemes": summarise_growths(rows), "long_runs": run_long(LONG // 10 if quick else LONG)}
    result |= {"momentum_error": momentum}
    for name, line in result["schemes"].items():
        print(f"{name:28s} {line['unstable']:4d} of {line['samples']} grow, worst {line['worst']:.1e} a window")
    print(json.dumps({name: result[name] for name in ("long_runs", "momentum_error")}, indent=1))
    results.write_and_print("coupling_stability", result | {"bars": judge_growths(result)})


if __name__ == "__main__":
    main()
