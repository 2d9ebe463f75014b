"""Printed parts: landing, curing, solid particles, restart, metrics and files."""

from contextlib import nullcontext

import meshio
import numba
import numpy as np
import pytest

from reflowshock.particles.core.checkpoint import Checkpoint
from reflowshock.particles.flows.droplet import DropletNumerics
from reflowshock.particles.flows.printing import Cure, Printing, PrintingNumerics
from reflowshock.particles.printing.deposit import HELD, LIQUID, SOLID, Deposit
from reflowshock.particles.printing.part import Layer, Part
from reflowshock.particles.printing.part_files import write_part
from reflowshock.particles.printing.printing import solve_printing
from reflowshock.workflow.flows.printed_part import layer_table, part_scene

INK = {
    "drop_volume": 6.37e-15, "surface_tension": 0.072, "viscosity": 0.0149, "speed": 3.0, "delay": 1e-3,
    "pitch": 23.2e-6, "columns": 2, "rows": 1,
}  # fmt: skip
BRIEF = PrintingNumerics(particles_per_diameter=8, settling=0.5)  # two drops: the second lands on cured ink


def printing(**changes):
    """Return the parameters of a small print; ``changes`` replace them."""
    return Printing(**INK | {"numerics": BRIEF} | changes)


def test_orders_of_drops():
    scene = printing(columns=2, rows=2, pitch=2.0)
    assert scene.places() == [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
    assert scene.model_copy(update={"order": "serpentine"}).places()[2:] == [(1.0, 1.0), (-1.0, 1.0)]
    assert scene.model_copy(update={"order": "interleaved"}).places()[:2] == [(-1.0, -1.0), (1.0, 1.0)]
    assert scene.drops == 4 and isinstance(scene.drop.numerics, DropletNumerics)
    assert printing(substrate_angle=0.1).velocity[0] == pytest.approx(3.0 * np.sin(0.1))


def test_what_gets_its_dose_is_held_and_a_body_without_liquid_is_solid():
    scene = printing(cure=Cure(depth=10e-6))
    deposit = Deposit(scene)
    deposit.add_drop((0.0, 0.0))
    top = deposit.points[:, 2]
    laplace = 4.0 * scene.surface_tension / scene.length
    assert deposit.pressures.mean() == pytest.approx(laplace, rel=0.05)
    deposit.expose(deposit.cures_in())
    assert deposit.cure()
    held = deposit.state == HELD
    assert held.any() and (deposit.state == LIQUID).any()
    assert top[held].mean() > top[~held].mean()  # light comes from above
    assert not deposit.pressures[held].any()
    before = deposit.points[held].copy()
    for _ in range(3):
        deposit.step(1.0)
    deposit.update()
    assert np.array_equal(deposit.points[held], before)
    deposit.expose(1.0)
    assert deposit.cure()
    assert (deposit.state == SOLID).all() and deposit.simulation is None and len(deposit.bodies) == 1
    again = Deposit(scene)
    again.restore(deposit.saved())  # interrupted while everything was solid
    for state in (deposit, again):
        state.add_drop((0.0, 0.0))
    assert np.array_equal(again.points, deposit.points) and np.array_equal(again.dose, deposit.dose)
    below, above = deposit.points[deposit.drop == 0], deposit.points[deposit.drop == 1]
    gaps = np.linalg.norm(below[:, None] - above, axis=2)
    assert gaps.min() > scene.spacing


def test_threads_are_those_that_pay_for_what_moves(monkeypatch):
    asked = []

    def remembered(particles):
        asked.append(particles)
        return nullcontext()

    monkeypatch.setattr("reflowshock.particles.printing.printing.threads_for", remembered)
    solve_printing(printing(columns=1, numerics=PrintingNumerics(particles_per_diameter=8, settling=0.5)))
    assert min(asked) == 0 and max(asked) == Deposit(printing()).start[0].shape[1]  # one drop, not all


def test_the_largest_spray_of_a_print_is_kept():
    deposit = Deposit(printing())
    deposit.add_drop((0.0, 0.0))
    liquid = deposit.simulation.fluids * deposit.law.spacing**3
    for share in (0.25, 0.125):
        deposit.surface.spray = share * liquid
        deposit.step(1.0)
    assert deposit.spray == pytest.approx(0.25)
    again = Deposit(printing())
    again.restore(deposit.saved())
    assert again.spray == deposit.spray
    again.add_drop((23e-6, 0.0))
    assert again.surface.spray == 0.0 and again.spray == deposit.spray


@pytest.mark.long
def test_one_thread_and_two_print_the_same_bits():
    results = []
    for threads in (1, 2):
        deposit = Deposit(printing())
        deposit.add_drop((0.0, 0.0))
        deposit.expose(1.0)
        deposit.cure()
        deposit.add_drop((5e-6, 0.0))
        numba.set_num_threads(threads)
        for _ in range(150):
            deposit.step(1.0)
        deposit.update()
        results.append((deposit.points, deposit.surface.points, deposit.fields.density))
    assert (deposit.surface.mesh.wetness > 0.0).any()
    for serial, parallel in zip(*results, strict=True):
        assert np.array_equal(serial, parallel)


@pytest.mark.parametrize(
    ("parts", "voids", "outcome"),
    [(1, 0, "merged"), (4, 0, "separate"), (2, 0, "partly merged"), (1, 2, "voids"), (4, 1, "voids")],
)
def test_a_part_says_what_became_of_its_drops(parts, voids, outcome):
    nothing = np.empty(0)
    layers = [Layer(k, 4, 4, parts, 1.0, 1.0, 1.0, 1.0, 1.0, voids) for k in (1, 2)]
    assert Part(nothing, nothing, nothing, nothing, nothing, layers, np.ones(voids)).outcome == outcome


@pytest.mark.long
def test_two_drops_are_printed_to_the_same_bits_after_a_restart(tmp_path):
    scene, calls = printing(), []

    class Killed(Exception):
        pass

    def kill(done):
        calls.append(done)
        if done >= 0.5 and len(calls) > 300:
            raise Killed

    whole, part = solve_printing(scene)
    with pytest.raises(Killed):
        solve_printing(scene, kill, Checkpoint(tmp_path / "part", (scene,), interval=0.0))
    again = Checkpoint(tmp_path / "part", (scene,), interval=0.0)
    continued, same = solve_printing(scene, None, again)
    assert again.continued
    for name, column in whole.history.items():
        assert np.array_equal(column, continued.history[name]), name
    assert np.array_equal(whole.pictures[-1].points, continued.pictures[-1].points)
    assert np.array_equal(part.heights, same.heights)
    assert whole.metrics["spray_share"] == continued.metrics["spray_share"]
    metrics = {name: value for name, (value, _) in whole.metrics.items()}
    assert metrics["drops"] == 2 and abs(metrics["volume_error"]) < 0.01 and abs(metrics["volume_drift"]) < 0.01
    assert metrics["roughness_sa"] > 0.0 and metrics["connected_parts_max"] in (1.0, 2.0)
    assert metrics["height_max"] == pytest.approx(part.heights.max())
    assert 0.5 * scene.length < part.heights.max() < scene.length
    write_part(tmp_path, part)
    assert len(meshio.read(tmp_path / "part.stl").cells[0].data) == len(part.triangles)
    (layer,) = part.layers
    assert layer.volume == pytest.approx((1.0 + metrics["volume_error"]) * 2 * scene.drop_volume)
    assert layer.roughness_sa == metrics["roughness_sa"] and layer.roughness_sz == metrics["roughness_sz"]
    table = layer_table(tmp_path / "layers.csv")
    assert table["head"][:3] == ["layer", "height [µm]", "Sa [µm]"]
    assert [row[0] for row in table["rows"]] == ["1"] and float(table["rows"][0][4]) == pytest.approx(12.74, rel=0.01)
    scene_3d = part_scene(tmp_path / "part.stl")
    assert scene_3d.fields[0].high == pytest.approx(1e6 * part.points[:, 2].max(), rel=1e-5)
    assert len(scene_3d.groups[0].points) == len(part.points)
