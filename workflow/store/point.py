"""Point of a run or study: a case with settings, identified by the inputs of all its stages."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from reflowshock.workflow.case.case import Case
from reflowshock.workflow.store.keys import product_keys


@dataclass(frozen=True, slots=True)
class Point:
    """Case with settings.

    Attributes:
        settings: Dotted key -> value, as text for ``--set``.
        case: The resolved case.
        digests: Stage -> key of its product.
    """

    settings: Mapping[str, str]
    case: Case
    digests: Mapping[str, str] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "digests", product_keys(self.case))

    @property
    def key(self) -> str:
        """Product key of the last stage, the report, which follows all other stages."""
        return self.digests[self.case.pipeline.names[-1]]
