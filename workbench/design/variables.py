"""What a search may change: the 16 angles within named bounds, the speed, numbers of the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from workbench.errors import InputError, did_you_mean
from workbench.optimize import Space
from workbench.schemas import UNITS
from workbench.sim import LIMITS

__all__ = ["ANGLES", "BOUNDS", "SPEED", "Bounds", "Varied", "make_space", "parse_varied"]

ANGLES = tuple(f"alpha_{k}" for k in range(16))
SPEED = "omega"
"""Name of the rotor's speed [rad/s] as a variable."""

SUM_LOWER_RAD, SUM_UPPER_RAD = -0.1, 1.2 * np.pi  # of alpha_1 to alpha_15, eq. 5.4 to 5.6


class Bounds(NamedTuple):
    """Bounds of the angles.

    Args:
        lower: alpha_0 to alpha_15 [rad].
        upper: alpha_0 to alpha_15 [rad].
        source: where in the thesis.
    """

    lower: tuple[float, ...]
    upper: tuple[float, ...]
    source: str


BOUNDS = {
    "thesis": Bounds(
        (-3.0, *3 * (-0.1,), *12 * (0.0,)), (-1.0, *3 * (0.5,), *12 * (0.6,)), "eq. 5.2 and 5.3"
    ),
    "appendix-e": Bounds(
        (-3.0, *2 * (-0.1,), *13 * (0.0,)),
        (-1.0, *2 * (0.5,), *13 * (0.6,)),
        "Appendix E, where alpha_3 has the bounds of the angles after it",
    ),
}
"""The two sets that the thesis gives, by name."""


class Varied(NamedTuple):
    """A variable beside the angles.

    Args:
        name: `omega` or a parameter of the model.
        lower: least value, SI.
        upper: greatest value, SI.
    """

    name: str
    lower: float
    upper: float

    @property
    def unit(self) -> str:
        """Return the unit of the bounds."""
        return "rad/s" if self.name == SPEED else UNITS[self.name]


def parse_varied(text: str) -> Varied:
    """Read `NAME=LOWER:UPPER`, SI.

    Raises:
        InputError: with the form, or with the names that exist.
    """
    name, _, interval = text.partition("=")
    lower, _, upper = interval.partition(":")
    try:
        varied = Varied(name.strip(), float(lower), float(upper))
    except ValueError:
        raise InputError(
            f"{text!r} is no variable; write NAME=LOWER:UPPER in SI units, for example "
            "top_mass=0.06:0.12 or omega=15:21"
        ) from None
    known = [SPEED, *UNITS]
    if varied.name not in known:
        raise InputError(
            f"nothing named {varied.name!r} can be varied{did_you_mean(varied.name, known)}; "
            f"there are {', '.join(known)}"
        )
    fastest = LIMITS["speed"].value
    if varied.name == SPEED and not -fastest <= varied.lower < varied.upper <= fastest:
        raise InputError(
            f"omega {varied.lower:g} to {varied.upper:g} rad/s: the lower one comes first, both "
            f"from -{fastest:g} to {fastest:g} rad/s"
        )
    return varied


def make_space(
    bounds: Bounds,
    angles: Sequence[float],
    varied: Sequence[Varied] = (),
    stated: Mapping[str, float] | None = None,
) -> Space:
    """Return the space of a search that begins at a shape and at the stated numbers.

    Args:
        bounds: of the angles; their sum but the first's stays within eq. 5.4 to 5.6.
        angles: alpha_0 to alpha_15 where the search begins [rad].
        varied: variables beside the angles.
        stated: value of each of them, SI; one outside its bounds begins at the nearer of them.

    Raises:
        InputError: when the shape is outside the bounds, or bounds leave nothing to search.
    """
    stated = stated or {}
    starts = [min(max(stated[v.name], v.lower), v.upper) for v in varied]
    return Space(
        names=(*ANGLES, *(v.name for v in varied)),
        lower=np.array([*bounds.lower, *(v.lower for v in varied)]),
        upper=np.array([*bounds.upper, *(v.upper for v in varied)]),
        start=np.array([*angles, *starts]),
        summed=ANGLES[1:],
        sum_lower=SUM_LOWER_RAD,
        sum_upper=SUM_UPPER_RAD,
    )
