import contextlib
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.protocol.quantity import DIMENSIONS, Quantity, parse_quantity


@given(
    st.sampled_from([(d, u) for d, units in DIMENSIONS.items() for u in units]),
    st.floats(-1e6, 1e6, allow_nan=False),
)
def test_every_unit_reads_back_its_factor(unit: tuple[str, str], number: float) -> None:
    dimension, name = unit
    value, found = parse_quantity(f"{number!r} {name}", dimension)
    assert found == name
    assert value == pytest.approx(number * DIMENSIONS[dimension][name])


@given(st.text(max_size=20))
def test_any_other_text_is_refused_and_never_crashes(text: str) -> None:
    with contextlib.suppress(ValueError):  # anything else is a crash
        assert math.isfinite(parse_quantity(text, "speed")[0])


def test_bounds_are_told_in_the_unit_that_was_written() -> None:
    with pytest.raises(ValueError, match=r"9000 mV is not allowed; it must be at most 5500 mV"):
        Quantity("voltage", high=5.5).read("9000 mV")
    assert Quantity("voltage", high=5.5).read("5500 mV") == pytest.approx(5.5)


@pytest.mark.parametrize("text", ["1e999 s", "nan s", "inf s", "1,5 s", "0x10 s", "--1 s", True])
def test_odd_numbers_are_refused(text: object) -> None:
    with pytest.raises(ValueError, match=r"not a|unknown unit"):
        parse_quantity(text, "time")
