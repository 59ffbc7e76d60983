import contextlib
import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.schemas import DIMENSIONS, parse_quantity
from workbench.schemas.quantity import UnitQuantity


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
        UnitQuantity("voltage", high=5.5).read("9000 mV")
    assert UnitQuantity("voltage", high=5.5).read("5500 mV") == pytest.approx(5.5)


@pytest.mark.parametrize("text", ["1e999 s", "nan s", "inf s", "1,5 s", "0x10 s", "--1 s", True])
def test_odd_numbers_are_refused(text: object) -> None:
    with pytest.raises(ValueError, match=r"not a|unknown unit|decimal comma"):
        parse_quantity(text, "time")


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("21,5 °C", "temperature", 21.5), ("21 ℃", "temperature", 21),
        ("-3,2 Grad C", "temperature", -3.2),
        ("4,5 V", "voltage", 4.5), ("4,5V", "voltage", 4.5), (",5 v", "voltage", 0.5),
        ("3 Sec", "time", 3),
        ("1:00:05", "time", 3605), ("60 U/min", "speed", 2 * math.pi),
        ("60 1/min", "speed", 2 * math.pi),
        ("\u22125 mm", "length", -0.005), ("0,500 g", "mass", 0.0005), ("2,5 Min", "time", 150),
        ("1,2345 m", "length", 1.2345),
    ],
)  # fmt: skip
def test_what_is_typed_is_understood_where_it_means_one_thing(
    text: str, dimension: str, value: float
) -> None:
    assert parse_quantity(text, dimension, typed=True)[0] == pytest.approx(value)


@pytest.mark.parametrize(
    ("text", "dimension", "words"),
    [
        ("1,500 g", "mass", "may be 1.500 or 1500; write '1.500 g' or '1500 g'"),
        ("1:30", "time", "may be hours or minutes; write '90 min' or '90 s'"),
        ("1,234.5 g", "mass", "has a comma among its digits"),
        ("12,5", "length", "'12.5 mm'"),
        ("3 MV", "voltage", "unknown unit 'MV'"),
        ("10 K", "temperature", "known units: degC, °C"),
    ],
)
def test_what_could_mean_two_things_is_never_guessed(text: str, dimension: str, words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        parse_quantity(text, dimension, typed=True)


def test_a_file_has_one_form_and_says_which() -> None:
    for text, words in (("4,5 V", "write '4.5 V'"), ("4,5", "write '4.5 V'")):
        with pytest.raises(ValueError, match=f"has a decimal comma; {words}"):
            parse_quantity(text, "voltage")
    with pytest.raises(ValueError, match="did you mean 'degC'"):
        parse_quantity("10 Grad C", "temperature")
    assert parse_quantity("10 °C", "temperature") == (10, "°C")


def test_a_hint_is_a_unit_of_the_kind_that_is_allowed() -> None:
    every = {unit for units in DIMENSIONS.values() for unit in units}
    wrongs = ["Sec", "m/s", "U/min", "°", "Cm", "volts", "rad", "xx", "K", "mmm", "hZ", "degF"]
    for dimension, units in DIMENSIONS.items():
        for wrong in {*wrongs, *every} - set(units):
            with pytest.raises(ValueError, match="unknown unit") as caught:
                parse_quantity(f"3 {wrong}", dimension)
            hint = re.search(r"did you mean '(.*)'", str(caught.value))
            assert hint is None or hint[1] in units


def test_a_long_text_is_refused_at_once() -> None:
    with pytest.raises(ValueError, match="is not a number with a unit") as caught:
        parse_quantity("1 " + " " * 100_000 + "x", "time")
    assert len(str(caught.value)) < 200
