"""Two joints that are one body: where its pads are, in a quarter model also behind a plane of symmetry; its mesh."""

import itertools
import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from reflowshock.workflow.package.case import PackageCase

if TYPE_CHECKING:
    from reflowshock.meshing.board.package_side import PackageSide
    from reflowshock.meshing.board.pads import PadSite
    from reflowshock.meshing.joint.joint_mesh import JointMesh
    from reflowshock.meshing.surface.closed_surface import ClosedSurface

logger = logging.getLogger(__name__)

BETWEEN = "+"  # the names of two joints that are one body
IMAGE = "_image"  # ends the name of a joint behind a plane of symmetry


@dataclass(frozen=True, slots=True)
class MirroredSide:
    """The underside of a quarter of a package, and its images behind x = 0 and y = 0."""

    quarter: "PackageSide"

    def height(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return the height (k,) over the board's top face at points (k,), (k,) [m]."""
        return self.quarter.height(np.abs(x), np.abs(y))


def mesh_bridges(
    surfaces: "Mapping[str, ClosedSurface]", sites: "Mapping[str, PadSite]", case: PackageCase, side: "PackageSide"
) -> "list[JointMesh]":
    """Mesh the joints that are one body, for other codes: no shock is run with them.

    Args:
        surfaces: by name; those of bridged joints have both names.
        sites: of all joints, by name.
        case: package, symmetry.
        side: the package's underside.
    """
    from reflowshock.meshing.joint.solder_mesh import JointMeshError, mesh_bridge

    quarter = case.board.symmetry == "quarter"
    meshes = []
    for name in (name for name in surfaces if BETWEEN in name):
        first, second = (sites[own] for own in name.split(BETWEEN))
        pair = (first, _nearest_image(first, second)) if quarter else (first, second)
        try:
            meshes.append(mesh_bridge(surfaces[name], pair, case.package, MirroredSide(side) if quarter else side))
        except JointMeshError as error:  # the verdict stands without it
            logger.warning("%s are bridged, but their common body was not meshed: %s", name, error)
    return meshes


def _nearest_image(first: "PadSite", second: "PadSite") -> "PadSite":
    """Return the second site or that of its images which is nearest to the first one."""
    images = [second]
    for along_x, along_y in itertools.product((1.0, -1.0), repeat=2):
        if (along_x, along_y) != (1.0, 1.0):
            images.append(replace(second, name=second.name + IMAGE, x=along_x * second.x, y=along_y * second.y))
    apart = [site for site in images if math.dist((site.x, site.y), (first.x, first.y)) > 0.0]
    return min(apart, key=lambda site: math.dist((site.x, site.y), (first.x, first.y)))
