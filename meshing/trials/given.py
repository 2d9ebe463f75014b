"""A triangulation as from elsewhere: a barrel is written to a file with a fault, noise and turn, and read again."""

import tempfile
from pathlib import Path

import meshio
import numpy as np

from reflowshock.meshing.board.pads import PadSite, pad_table
from reflowshock.meshing.board.parameters import Warpage
from reflowshock.meshing.joint.solder_mesh import mesh_joint
from reflowshock.meshing.surface.closed_surface import ClosedSurface
from reflowshock.meshing.surface.user_surface import load_surface
from reflowshock.meshing.trials.faults import FAULTS
from reflowshock.meshing.trials.joints import Meshed
from reflowshock.meshing.trials.models import MM, board, package, side_of
from reflowshock.meshing.trials.surfaces import barrel

NAME = "A4"


def site() -> PadSite:
    """Where it goes: the corner joint of a small, flat package."""
    return {place.name: place for place in pad_table(package(), board(), Warpage())}[NAME]


def load_given(fault: str, bulge: float, noise: float, turn: float) -> tuple[ClosedSurface, ClosedSurface]:
    """Write a barrel and read it.

    Args:
        fault: name of one of `FAULTS`.
        bulge: of the barrel [m].
        noise: standard deviation of what is added to its vertices [m].
        turn: about the x axis [rad].

    Returns:
        What was read, and the barrel.

    Raises:
        SurfaceError: it is refused.
    """
    exact = barrel(site().gap, bulge)
    points, triangles = FAULTS[fault](exact.points, exact.triangles.astype(np.int64))
    points = points + np.random.default_rng(2).normal(0.0, noise, points.shape)
    cosine, sine = np.cos(turn), np.sin(turn)
    points = points @ np.array([[1.0, 0.0, 0.0], [0.0, cosine, sine], [0.0, -sine, cosine]])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "joint.stl"
        meshio.write(path, meshio.Mesh(points / MM, [("triangle", triangles)]))
        return load_surface(path, "mm", site()), exact


def mesh_given(surface: ClosedSurface) -> Meshed:
    """Mesh what was read; JointMeshError where no mesh meets its bars."""
    whole, side = package(), side_of(Warpage(), package())
    return Meshed(mesh_joint(surface, site(), whole, side), surface, side, whole.copper.thickness)
