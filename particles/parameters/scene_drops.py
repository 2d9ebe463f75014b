"""Scene of two drops side by side. Its parameters in SI floats."""

from typing import Annotated

from pydantic import Field

from reflowshock.particles.parameters.scenes import PI
from reflowshock.particles.parameters.solder import Parameters


class Drops(Parameters):
    """Two drops, their centres a distance apart, that are meant to become one or (with merge = false) to stay apart.

    With a contact angle they start as cubes on a wall and spread; without, there is no wall and they start as balls.
    """

    volume_left: Annotated[float, "mm^3"] = Field(gt=0)
    volume_right: Annotated[float, "mm^3"] = Field(gt=0)
    distance: Annotated[float, "mm"] = Field(gt=0)
    merge: bool = True
    contact_angle: Annotated[float | None, "deg"] = Field(None, gt=0, lt=PI)
    spacing: Annotated[float, "mm"] = Field(1.0e-4, gt=0)

    @property
    def volumes(self) -> tuple[float, float]:
        """Both volumes [m^3]."""
        return self.volume_left, self.volume_right

    @property
    def volume(self) -> float:
        """Volume of both together [m^3]."""
        return sum(self.volumes)

    @property
    def resolution(self) -> float:
        """Spacing of the particles at the start [m]."""
        return self.spacing

    @property
    def is_free(self) -> bool:
        """Whether there is no wall."""
        return self.contact_angle is None

    @property
    def contact_angles(self) -> dict[str, float]:
        """Contact angle as the solder has it [rad]."""
        return {} if self.contact_angle is None else {"pad_contact_angle": self.contact_angle}

    def per_edge(self, volume: float) -> int:
        """Particles along an edge of the cube of a volume [m^3]."""
        return 1 + round(volume ** (1.0 / 3.0) / self.spacing)

    @property
    def particles(self) -> int:
        """Particles of both cubes; balls have nearly as many."""
        return sum(self.per_edge(volume) ** 3 for volume in self.volumes)
