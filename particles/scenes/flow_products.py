"""Files of a flow: pictures and history as HDF5, the particles at the end for ParaView."""

from pathlib import Path

import h5py
import meshio
import numpy as np

from reflowshock.particles.scenes.products import untimed
from reflowshock.particles.sph.flow import FlowResult, Picture

FLOW = "flow.h5"


def write_flow(folder: Path, result: FlowResult) -> None:
    """Write `flow.h5` and `particles.vtu`."""
    with h5py.File(folder / FLOW, "w") as file:
        file["walls"] = result.walls
        for name, column in result.history.items():
            file[f"history/{name}"] = column
        for number, picture in enumerate(result.pictures):
            place = file.create_group(f"pictures/{number:04d}")
            place.attrs["time"] = picture.time
            for name in ("points", "velocity", "pressure"):
                place[name] = getattr(picture, name)
        for name, (value, unit) in untimed(result.metrics).items():
            place = file.create_group(f"metrics/{name}")
            place.attrs["value"], place.attrs["unit"] = value, unit
    end = result.pictures[-1]
    cells = [("vertex", np.arange(len(end.points)).reshape(-1, 1))]
    data = {"velocity": end.velocity, "pressure": end.pressure}
    meshio.Mesh(end.points, cells, point_data=data).write(folder / "particles.vtu", file_format="vtu")


def read_flow(folder: Path) -> FlowResult:
    """Read what `write_flow` wrote."""
    with h5py.File(folder / FLOW, "r") as file:
        pictures = [
            Picture(float(place.attrs["time"]), place["points"][()], place["velocity"][()], place["pressure"][()])
            for _, place in sorted(file["pictures"].items())
        ]
        history = {name: column[()] for name, column in file["history"].items()}
        metrics = {
            name: (float(place.attrs["value"]), str(place.attrs["unit"])) for name, place in file["metrics"].items()
        }
        return FlowResult(pictures, file["walls"][()], history, metrics)
