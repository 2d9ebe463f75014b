"""Files of data come back as they were written; any other file is refused, and nothing in it is executed."""

from dataclasses import dataclass

import numpy as np
import pytest

from reflowshock.data_file import NotData, columns, read_data, read_header, rows, write_data
from reflowshock.particles.parameters.solder import Solder, SolderNumerics
from tests.support.forged_files import DAMAGES, forged_array, with_digest


@dataclass(frozen=True, slots=True)
class Wheel:
    radius: float
    spokes: np.ndarray


@dataclass
class Cart:
    wheels: tuple[Wheel, ...]
    name: str | None = None


def test_a_value_comes_back_as_it_was(tmp_path):
    shared = np.arange(6.0).reshape(2, 3)
    value = {
        "numbers": [1, -2.5e-300, True, None, float("inf"), np.float64(0.1), np.int32(7)],
        "text": "°C, \n and \u0000",
        "pair": (1, (2.0, "three")),
        "path": tmp_path / "there",
        "nested": {"a/b": shared, "a": {"b": shared + 1.0}, "nothing": {}},
        "again": [shared, shared.T, shared[:0], np.array(3, np.int8), np.array(["growth", "by displacement"])],
    }
    write_data(tmp_path / "file", {"owner": "me", "window": 3}, value)
    assert read_header(tmp_path / "file") == {"owner": "me", "window": 3}
    restored = read_data(tmp_path / "file")
    assert [*restored["numbers"]] == [1, -2.5e-300, True, None, float("inf"), 0.1, 7]
    assert {name: restored[name] for name in ("text", "pair", "path")} == {
        name: value[name] for name in ("text", "pair", "path")
    }
    assert restored["nested"]["nothing"] == {}
    arrays = [restored["nested"]["a/b"], restored["nested"]["a"]["b"], *restored["again"]]
    for actual, other in zip(arrays, [shared, shared + 1.0, *value["again"]], strict=True):
        assert actual.dtype == other.dtype
        assert actual.flags.f_contiguous == other.flags.f_contiguous
        np.testing.assert_array_equal(actual, other)
    assert restored["again"][0] is restored["nested"]["a/b"]


def test_records_come_back_where_the_reader_takes_them(tmp_path):
    cart = Cart((Wheel(0.5, np.ones(3)), Wheel(0.7, np.zeros(2))), "hay")
    solder = Solder(volume=1e-10, numerics=SolderNumerics(spacing=1e-4))
    write_data(tmp_path / "file", {}, [cart, solder])
    restored, melted = read_data(tmp_path / "file", (Cart, Wheel, Solder))
    assert melted == solder
    assert isinstance(restored, Cart)
    assert restored.name == "hay"
    assert [wheel.radius for wheel in restored.wheels] == [0.5, 0.7]
    np.testing.assert_array_equal(restored.wheels[0].spokes, np.ones(3))
    with pytest.raises(NotData, match="Wheel"):
        read_data(tmp_path / "file", (Cart, Solder))


def test_rows_become_a_table_and_rows_again():
    records = [{"time": 0.5 * k, "flips": k, "binding": "growth", "strain": np.arange(2.0) * k} for k in range(3)]
    restored = rows(columns(records))
    assert [{**row, "strain": row["strain"].tolist()} for row in restored] == [
        {**row, "strain": row["strain"].tolist()} for row in records
    ]
    assert type(restored[1]["time"]) is float
    assert rows(columns([])) == []


@pytest.mark.parametrize(
    "value, message",
    [
        ({"work": print}, "not a supported type"),
        ([np.array([None])], "value/0: arrays of objects"),
        ({1: "wall"}, "1 is not a valid name"),
        ({"@": "array"}, "'@' is not a valid name"),
    ],
)
def test_unsupported_values_are_rejected(tmp_path, value, message):
    with pytest.raises(TypeError, match=message):
        write_data(tmp_path / "file", {}, value)
    assert not list(tmp_path.iterdir())


def test_any_flipped_bit_is_noticed(tmp_path):
    path = tmp_path / "file"
    write_data(path, {"owner": "me"}, {"points": np.arange(4.0), "time": 1.0})
    content = path.read_bytes()
    for at in range(len(content)):
        path.write_bytes(content[:at] + bytes([content[at] ^ (1 << at % 8)]) + content[at + 1 :])
        with pytest.raises(NotData):
            read_data(path)


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_file_is_rejected_and_not_executed(tmp_path, damage):
    path, marker = tmp_path / "file", tmp_path / "marker"
    write_data(path, {"owner": "me"}, {"points": np.arange(100.0)})
    path.write_bytes(damage(path.read_bytes(), marker))
    with pytest.raises(NotData, match=str(path)):
        read_data(path)
    assert not marker.exists()


def test_forged_files_would_run_code(tmp_path):
    """Else the test above shows nothing."""
    (tmp_path / "file.npz").write_bytes(forged_array(tmp_path / "marker"))
    with np.load(tmp_path / "file.npz", allow_pickle=True) as arrays:
        arrays["tree"]
    assert (tmp_path / "marker").exists()


def test_a_class_of_the_library_is_not_made(tmp_path):
    path, marker = tmp_path / "file", tmp_path / "marker"
    tree = f'{{"@": "pathlib.Path.touch", "fields": {{"self": "{marker}"}}}}'
    write_data(path, {}, None)
    np.savez(tmp_path / "rest.npz", tree=np.frombuffer(tree.encode(), np.uint8))
    path.write_bytes(with_digest(path.read_bytes(), (tmp_path / "rest.npz").read_bytes()))
    with pytest.raises(NotData, match=r"KeyError: 'pathlib\.Path\.touch'"):
        read_data(path, (Wheel,))
    assert not marker.exists()
