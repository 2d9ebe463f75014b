"""Which coupling scheme a problem calls for, and why."""

from dataclasses import dataclass

from reflowshock.fem.division.division import SchemeName


@dataclass(frozen=True, slots=True)
class Choice:
    """A scheme, and the reason in words."""

    scheme: SchemeName
    why: str


def choose_scheme(elastic: bool, buffer_possible: bool) -> Choice:
    """Choose the scheme of a two-way run whose user leaves it open.

    All are stable at the steps that a run chooses (benchmarks/coupling_stability.py). Local steps keep energy and
    momentum but know no path: plastic strains would be those of a mean motion, half as large or twice (PHYSICS 4). Held
    velocity lets both models work at the same time; impulses, which keep momentum exactly along a path, do not, and are
    taken where the user asks for them. Gravouil-Combescure's link takes energy from what moves, and waits, too.

    Args:
        elastic: Whether all of the meso model is linear elastic at small strains.
        buffer_possible: Whether two layers of board fit between what is fine and the macro model.
    """
    if elastic:
        return Choice("local_steps", "all that takes small steps is linear elastic at small strains")
    if buffer_possible:
        return Choice("held_velocity", "what takes small steps depends on its path; layers of board fit around it")
    return Choice(
        "gravouil_combescure", "what takes small steps depends on its path; no two layers of board fit around it"
    )
