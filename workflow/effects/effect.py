"""One effect of the program, as a record."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Effect:
    """An effect: an object in a list, absent where the scene does not call for it.

    Attributes:
        name: as in plans, reports and ``summary.json``.
        stage: in which it acts.
        adds: what it adds to the equations.
        number: its dimensionless number.
        influence: expected relative change of the answer, as a formula of the number.
        place: dotted name of the object, or of the function that decides.
        switch: the key of a case file, and its values.
        source: of the number or the law.
        acts: whether it acts above or below the threshold.
        threshold: of the number; None where the scene says itself whether the effect is there.
    """

    name: str
    stage: str
    adds: str
    number: str
    influence: str
    place: str
    switch: str
    source: str
    acts: str = "above"
    threshold: float | None = None
