"""Companions of a drop: the same drop on coarser meshes, or with half the window, run to estimate errors.

A window is the interval between two exchanges of the coupled models. The fine joints and the end of a companion are
those of the run. The coarsest companion gives the error of two scales: by one model of the same drop where that is
cheap, otherwise by a further companion with half the window.
"""

from pathlib import Path

from reflowshock.meshing.board.pads import pad_table
from reflowshock.parameters import Values, with_values
from reflowshock.workflow.board_drop.board_deflection import expected_duration
from reflowshock.workflow.board_drop.coarser_case import coarser, fewer_layers
from reflowshock.workflow.board_drop.fine_joints import read_fine_joints
from reflowshock.workflow.board_drop.shock_launch import main_mode
from reflowshock.workflow.package.case import BoardDropCase
from reflowshock.workflow.process.products import read_json, simulated_time
from reflowshock.workflow.store.companions import CHEAP, COARSEST, HALF_WINDOW, SIZES, size_name

LEAST_END = 0.5  # least duration of one model, over that of two, for an error of two scales


def drop_companions(case: BoardDropCase, shock: Path | None) -> dict[str, BoardDropCase]:
    """Return the companions of a drop, the same case on coarser meshes from whose results errors are estimated.

    Args:
        case: Case of the run.
        shock: Folder of the results of its shock, which decide the fine joints and the end; None before, for the
            expected ones.

    Returns:
        Case of each companion by name, ``size_1.5``, ``size_2`` and perhaps ``half_window``; empty if the case
        estimates no errors.
    """
    if not case.estimates_errors:
        return {}
    copies = {size_name(size): resized_drop(case, shock, size) for size in SIZES}
    main = main_mode(case)
    end = _end(case, shock, main)
    if main == "two_scale" and not compares_models(case, end):
        copies |= _for_two_scales(with_values(case, {"shock.duration": end}), copies[COARSEST])
    return copies


def resized_drop(case: BoardDropCase, shock: Path | None, size: float) -> BoardDropCase:
    """Return a drop with elements of another size, with the fine joints and the end of the run.

    The case has one rank, the first model of the run alone, and no estimate of errors.

    Args:
        case: Case of the run, not changed.
        shock: Folder of the results of its shock; None before, for the expected joints and end.
        size: Element size relative to the case; above one is coarser.
    """
    main = main_mode(case)
    same: Values = {
        "numerics.error.method": "off",
        "shock.coupling.fine_joints": _fine_joints(case, shock) if main == "two_scale" else "all",
        "shock.duration": _end(case, shock, main),
        "shock.numerics.modes": (main,),
        "shock.numerics.dns_duration": None,
        "shock.numerics.field_samples": 2,
        "shock.modes": 0,
        "shock.identical_joints": False,
        "shock.ranks.total": 1,
        "shock.ranks.placement": "auto",
        "shock.ranks.macro": None,
    }
    return with_values(case, same | coarser(case, size) | fewer_layers(case, size))


def compares_models(case: BoardDropCase, end: float) -> bool:
    """Return whether a two-scale run also computes one model without scales (DNS) for at least half of its time.

    Args:
        case: Case of the run.
        end: End of the run [s].
    """
    numerics = case.shock.numerics
    return {"two_scale", "dns"} <= set(numerics.modes) and (numerics.dns_duration or end) >= LEAST_END * end


def drop_sizes(_case: BoardDropCase, _shock: Path) -> dict[str, float]:
    """Return the element size of each companion relative to the case, by name: ``{"size_1.5": 1.5, "size_2": 2.0}``.

    The parts of a drop round their numbers of elements differently, up or down, so that the nominal size is taken. Both
    arguments, the case and the folder of its shock, are not used; the sizes of a structure depend on them.
    """
    return {size_name(size): size for size in SIZES}


def _for_two_scales(case: BoardDropCase, coarsest: BoardDropCase) -> dict[str, BoardDropCase]:
    """Return the coarsest companion with one model if that is cheap, otherwise a companion with half the window.

    One model runs until the end if that is cheap, otherwise for a part of the time. Half the window shows only the
    error of the coupling in time, not that of coarse joints.
    """
    most = CHEAP * _core_seconds(case)
    for duration in (None, LEAST_END * float(coarsest.shock.duration)):
        early = with_values(coarsest, {"shock.numerics.dns_duration": duration})
        if _core_seconds(with_values(early, {"shock.numerics.modes": ("dns",)})) <= most:
            return {COARSEST: with_values(early, {"shock.numerics.modes": ("two_scale", "dns")})}
    fraction = coarsest.shock.numerics.step_fraction
    return {HALF_WINDOW: with_values(coarsest, {"shock.numerics.step_fraction": 0.5 * fraction})}


def _core_seconds(case: BoardDropCase) -> float:
    """Predict the processor time of a shock [s]."""
    from reflowshock.workflow.board_drop.forecast import forecast_board_drop

    return case.ranks * forecast_board_drop(case).seconds["shock"]


def _fine_joints(case: BoardDropCase, shock: Path | None) -> tuple[str, ...] | str:
    """Return the fine joints of a run; before it, as many joints as it will have."""
    chosen = case.shock.coupling.fine_joints
    if chosen != "critical":
        return chosen
    found = None if shock is None else read_fine_joints(shock)
    if found is not None:
        return found.names
    names = tuple(pad.name for pad in pad_table(case.package, case.board, case.warpage))
    return names[: case.shock.coupling.critical_joints]


def _end(case: BoardDropCase, shock: Path | None, mode: str) -> float:
    """Return the end of a run [s]; before it, the expected one."""
    if case.shock.duration != "auto":
        return case.shock.duration
    if shock is None:
        return expected_duration(case)
    return simulated_time(read_json(shock / mode / "result.json"))
