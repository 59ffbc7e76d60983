from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from workbench.design import BOUNDS, Varied, make_space, parse_varied
from workbench.errors import InputError
from workbench.schemas import load_shape


def angles(name: str) -> tuple[float, ...]:
    return load_shape(name, Path()).content.angles


def test_the_bounds_are_those_of_the_thesis() -> None:
    """Eq. 5.2 and 5.3 say 0 < i < 4, Appendix E lists two such angles only."""
    main, appendix = BOUNDS["thesis"], BOUNDS["appendix-e"]
    assert main.lower == (-3.0, -0.1, -0.1, -0.1, *[0.0] * 12)
    assert main.upper == (-1.0, 0.5, 0.5, 0.5, *[0.6] * 12)
    assert appendix.lower == (-3.0, -0.1, -0.1, *[0.0] * 13)
    assert appendix.upper == (-1.0, 0.5, 0.5, *[0.6] * 13)


@pytest.mark.parametrize("bounds", BOUNDS)
@pytest.mark.parametrize("shape", ["thesis-initial", "thesis-ga-start"])
def test_both_first_shapes_are_within_both_bounds(bounds: str, shape: str) -> None:
    space = make_space(BOUNDS[bounds], angles(shape))
    assert space.contains(space.start)
    assert space.summed == tuple(f"alpha_{k}" for k in range(1, 16))
    assert (space.sum_lower, space.sum_upper) == (-0.1, 1.2 * math.pi)


def test_what_is_varied_begins_at_the_stated_value_or_the_nearer_bound() -> None:
    varied = [Varied("omega", 15.0, 21.0), Varied("top_mass", 0.1, 0.12)]
    space = make_space(
        BOUNDS["thesis"], angles("thesis-initial"), varied, {"omega": 17.0, "top_mass": 0.088}
    )
    assert space.names[-2:] == ("omega", "top_mass")
    assert space.start[-2:] == pytest.approx([17.0, 0.1])
    assert not set(space.names[-2:]) & set(space.summed)


def test_a_variable_is_read_with_its_bounds() -> None:
    assert parse_varied("rotor_radius=0.02:0.05") == Varied("rotor_radius", 0.02, 0.05)
    assert parse_varied("omega=15:21").unit == "rad/s"
    assert parse_varied("rotor_radius=0.02:0.05").unit == "m"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("top_mass", "write NAME=LOWER:UPPER in SI units"),
        ("top_mass=heavy:0.2", "write NAME=LOWER:UPPER in SI units"),
        ("topmass=0.1:0.2", "nothing named 'topmass' can be varied; did you mean 'top_mass'"),
        ("omega=21:15", "omega 21 to 15 rad/s: the lower one comes first"),
    ],
)
def test_a_variable_that_makes_no_sense_is_refused(text: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        parse_varied(text)


def test_a_shape_outside_the_bounds_is_named_with_its_angle() -> None:
    wrong = np.array(angles("thesis-initial"))
    wrong[7] = 0.7
    with pytest.raises(InputError, match=r"alpha_7: the start 0.7 is outside 0 to 0.6"):
        make_space(BOUNDS["thesis"], wrong.tolist())
