"""Reflow of an array coupled with board and package, which are heated, float or are moved."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.fem import statics
from reflowshock.fem.parallel.checkpoint_files import digest_of_files
from reflowshock.fem.problem.thermal import KELVIN, Thermal
from reflowshock.workflow.case.run import Run, at_most, metric
from reflowshock.workflow.package.case import PackageCase, joint_geometries
from reflowshock.workflow.process.terminal import ProgressBar, progress_bar
from reflowshock.workflow.reflow.array import CarriedGroup, JointArray, Source
from reflowshock.workflow.reflow.between import frozen_displacement, open_structure, thermal_effects
from reflowshock.workflow.reflow.coupling import Coupled, Coupling, Exchange, place_joints, scale_of, start
from reflowshock.workflow.reflow.forecast import LoadStep, load_steps
from reflowshock.workflow.reflow.joints import JointGroup
from reflowshock.workflow.reflow.pool import Shares
from reflowshock.workflow.reflow.processes import open_pool
from reflowshock.workflow.reflow.rigid_balance import RigidBalance

if TYPE_CHECKING:
    from reflowshock.fem.statics.state import HeatedStructure
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.particles.core.geometry import JointGeometry
    from reflowshock.particles.steps.shape import JointShape


@dataclass(frozen=True, slots=True)
class Heated:
    """Result of a coupled reflow.

    Attributes:
        geometries: Geometry by joint name when the solder froze.
        groups: Groups of equal joints.
        shapes: Shape by name of the first joint of a group.
        coupled: Final state of the coupling.
        steps: Load steps.
        structure: Arrays of ``structure.npz`` by name.
        effects: Decisions on temperature and plates.
        metrics: Metrics of the coupling, as in ``summary.json``.
        health: Health checks of the coupling, as in ``summary.json``.
        continued: Description of the exchange from which a run continued; empty for a run from the start.
    """

    geometries: "dict[str, JointGeometry]"
    groups: "list[JointGroup]"
    shapes: "dict[str, JointShape]"
    coupled: Coupled
    steps: list[LoadStep]
    structure: dict[str, np.ndarray]
    effects: dict
    metrics: dict
    health: dict
    continued: str


def reflow_heated(run: Run[PackageCase], thermal: Thermal, pads: "list[PadSite]", mesh: Path) -> Heated:
    """Compute solder and structure in all load steps.

    Args:
        run: Run with the products of the stage geometry.
        thermal: Temperatures, and motion of the package.
        pads: Pad table as drawn, with the prescribed warpage.
        mesh: File with the flat mesh of board and package.

    Returns:
        Geometry and shape of each joint when the solder freezes, arrays of the structure, metrics and health checks.

    Raises:
        NotInBalance: A load step does not converge.
        ReflowError: A joint failed; the message gives its name.
    """
    case, drawn, steps = run.case, joint_geometries(pads), load_steps(thermal)
    effects = thermal_effects(case, thermal, [step.temperature for step in steps])
    flexible, bends = (effects[name]["on"] for name in ("flexible", "solder_force"))
    with (
        open_structure(case, thermal, mesh, pads, flexible) as structure,
        open_pool(run, len(pads)) as pool,
        progress_bar(f"reflow of {len(pads)} joints in {len(steps)} load steps") as bar,
    ):
        display = CouplingProgress(bar, steps)
        joints = JointArray(case.solder, run.checkpoints("reflow"), pool, display.joints)
        scale = scale_of(list(drawn.values()), case.solder, structure.rigid_modes, thermal.tolerance)
        saved = CouplingFile(run.checkpoints("reflow"), all_inputs(case, pads))
        coupled = saved.read(joints) or _start(structure, drawn, case, steps[0])
        completed = len(coupled.exchanges)
        coupling = Coupling(structure, joints, drawn, scale, bends, saved.writer(joints), display.exchange)
        coupling.run(coupled, steps)
        metrics, health = _judge(coupling, coupled, steps, thermal)
        assert coupled.state is not None
        return Heated(
            geometries=place_joints(drawn, coupled.state.pad_motion),
            groups=[carried.group for carried in joints.groups],
            shapes=joints.shapes(),
            coupled=coupled,
            steps=steps,
            structure=_structure(coupled, steps, list(drawn))
            | {
                "points": structure.points,
                "displacement": frozen_displacement(case, structure, coupled.state.displacement),
                "package": structure.package,
            },
            effects=dict(effects),
            metrics=metrics | {"distinct_joints_computed": metric(len(joints.groups))},
            health=health,
            continued=f"exchange {completed + 1}" if completed else "",
        )


def _start(
    structure: "HeatedStructure", drawn: "dict[str, JointGeometry]", case: PackageCase, first: LoadStep
) -> Coupled:
    """Return the initial state, with the pads where the structure has them without solder."""
    modes = structure.rigid_modes
    alone = structure.solve(first.temperature, first.corner, *_no_loads(structure))
    return start(list(place_joints(drawn, alone.pad_motion).values()), case.solder, modes)


def _no_loads(structure: "HeatedStructure") -> tuple[np.ndarray, np.ndarray]:
    """Return zero wrenches, shape (joints, 2, 6), and zero rigid motions, shape (k,)."""
    motion = structure.rigid_modes.pad_motion
    return np.zeros(motion.shape[1:]), np.zeros(len(motion))


def all_inputs(case: PackageCase, pads: "list[PadSite]") -> tuple:
    """Return everything on which a saved coupled reflow depends, so that it continues only if nothing has changed.

    Args:
        case: Case of a package.
        pads: Pad table.

    Returns:
        Tuple of tables of the case, pads, and a digest of the sources.
    """
    folders = (Path(__file__).parent, Path(statics.__file__).parent)
    sources = digest_of_files(*(path for folder in folders for path in sorted(folder.glob("*.py"))))
    return case.package, case.board, case.warpage, case.solder, case.materials, case.thermal, pads, sources


def _records() -> tuple[type, ...]:
    """Return the record types of the file of a coupling."""
    from reflowshock.fem.statics.state import HeatedState
    from reflowshock.particles.core.geometry import JointGeometry
    from reflowshock.particles.scenes.orientation import Orientation

    return Coupled, RigidBalance, HeatedState, Exchange, CarriedGroup, Source, JointGroup, JointGeometry, Orientation


class CouplingFile:
    """File with the state of the coupling, from which a run continues the interrupted exchange."""

    def __init__(self, folder: Path, inputs: tuple) -> None:
        """Name the file.

        Args:
            folder: Folder of the checkpoints.
            inputs: All inputs of the state, see ``all_inputs``; a file of other inputs is ignored.
        """
        from reflowshock.particles.core.checkpoint import Checkpoint

        self._file = Checkpoint(folder / "coupling", inputs)

    def read(self, joints: JointArray) -> Coupled | None:
        """Return the saved state and set the groups of the joints; return None without a saved state."""
        saved = self._file.read(_records())
        if saved is None:
            return None
        joints.groups = saved["groups"]
        return saved["coupled"]

    def writer(self, joints: JointArray) -> Callable[[Coupled], None]:
        """Return a function that saves the state of the coupling and the groups of the joints."""
        return lambda coupled: self._file.write({"coupled": coupled, "groups": joints.groups})


class CouplingProgress:
    """Progress on the terminal: load step, temperature, exchange, residual, and joints in progress."""

    def __init__(self, bar: ProgressBar, steps: list[LoadStep]) -> None:
        """Start at the first load step."""
        self._bar, self._steps, self._completed, self._number = bar, steps, 0, 0
        self._residual = ""

    def joints(self, shares: Shares) -> None:
        """Show the progress of the joints of an exchange."""
        step = self._steps[min(self._completed, len(self._steps) - 1)]
        finished = sum(share >= 1.0 for share in shares.values())
        busy = [f"{name} {share:.0%}" for name, share in shares.items() if 0.0 < share < 1.0]
        self._bar(
            self._completed / len(self._steps),
            f"load step {self._completed + 1} of {len(self._steps)}, {step.temperature - KELVIN:.0f} °C, "
            f"exchange {self._number + 1}{self._residual}: {finished} of {len(shares)} joints {' '.join(busy)}",
        )

    def exchange(self, exchange: Exchange) -> None:
        """Record the residual of an exchange."""
        if exchange.load_step != self._completed:
            self._completed, self._number = exchange.load_step, 0
        self._number += 1
        self._residual = f", residual {exchange.residual:.1e}"


def _judge(coupling: Coupling, coupled: Coupled, steps: list[LoadStep], thermal: Thermal) -> tuple[dict, dict]:
    """Return metrics, and the health check of the residual unless nothing was iterated.

    The metrics are the residuals of all load steps, and the standoffs with and without the forces of the solder.
    """
    assert coupled.state is not None
    structure, drawn = coupling.structure, coupling.drawn
    last = final_exchanges(coupled)
    residual = max(exchange.residual for exchange in last)
    without, _ = _no_loads(structure)
    alone = structure.solve(steps[-1].temperature, steps[-1].corner, without, coupled.rigid)
    spreads = [
        float(np.ptp([joint.gap for joint in place_joints(drawn, state.pad_motion).values()]))
        for state in (coupled.state, alone)
    ]
    gaps = [joint.gap for joint in place_joints(drawn, coupled.state.pad_motion).values()]
    metrics = {
        "load_steps": metric(len(steps)),
        "exchanges": metric(len(coupled.exchanges)),
        "coupling_residual_max": metric(residual),
        "standoff_min": metric(min(gaps), "m"),
        "standoff_max": metric(max(gaps), "m"),
        "standoff_spread": metric(spreads[0], "m"),
        "standoff_spread_without_solder": metric(spreads[1], "m"),
    }
    iterated = coupling.bends or len(structure.rigid_modes.pad_motion) > 0
    return metrics, {"coupling_residual_max": at_most(residual, thermal.tolerance)} if iterated else {}


def final_exchanges(coupled: Coupled) -> list[Exchange]:
    """Return the last exchange (residuals of solder and structure) of each load step.

    Args:
        coupled: State of the coupling with all its exchanges.

    Returns:
        One exchange per load step, in order.
    """
    return list({exchange.load_step: exchange for exchange in coupled.exchanges}.values())


def _structure(coupled: Coupled, steps: list[LoadStep], names: list[str]) -> dict[str, np.ndarray]:
    """Return the arrays of the load steps for ``structure.npz``."""
    last = final_exchanges(coupled)
    counts = np.bincount([exchange.load_step for exchange in coupled.exchanges], minlength=len(steps))
    return {
        "joints": np.array(names),
        "temperature": np.array([step.temperature for step in steps]),
        "corner_displacement": np.array([step.corner for step in steps]),
        "iterations": counts,
        "force_residual": np.array([exchange.force_residual for exchange in last]),
        "rigid_residual": np.array([exchange.rigid_residual for exchange in last]),
        "pad_motion": np.array(coupled.pad_motion),
    }
