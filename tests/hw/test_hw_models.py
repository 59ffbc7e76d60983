from __future__ import annotations

from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.errors import HardwareError, InputError
from workbench.hw import MODELS, ModbusModel, Model, model_named
from workbench.hw.models import (
    DPS_REGISTERS,
    HANMATEK_REGISTERS,
    RIDEN_REGISTERS,
    from_word,
    model_with_id,
    to_word,
)

every_model = pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)


@every_model
def test_every_voltage_step_survives_the_register_exactly(model: Model) -> None:
    step = model.voltage_step_V
    for word in range(int(model.voltage_max_V / step) + 1):
        assert to_word(Decimal(str(word * step)), step) == word
        assert from_word(word, step) == word * step


@every_model
def test_every_thesis_voltage_is_at_most_half_a_step_off(model: Model) -> None:
    for omega in ("8.2", "10.4", "12.5", "16", "17", "18", "19", "19.9", "20", "21"):
        volts = (Decimal(omega) + Decimal("2.9")) / Decimal("4.4")
        word = to_word(volts, model.voltage_step_V)
        assert abs(from_word(word, model.voltage_step_V) - volts) <= model.voltage_step_V / 2


@given(st.decimals(0, 60, places=6), st.sampled_from(MODELS))
def test_no_voltage_is_more_than_half_a_step_off(volts: Decimal, model: Model) -> None:
    word = to_word(volts, model.voltage_step_V)
    assert abs(from_word(word, model.voltage_step_V) - volts) <= model.voltage_step_V / 2


def test_435_hundredths_are_not_truncated_to_434() -> None:
    assert to_word(Decimal("4.35"), model_named("RD6006").voltage_step_V) == 435
    assert int(4.35 * 100) == 434  # what published drivers write


def test_a_tie_goes_to_the_even_word() -> None:
    step = Decimal("0.01")
    assert [to_word(Decimal(v), step) for v in ("4.345", "4.355", "4.365")] == [434, 436, 436]


def test_ids_do_not_overlap() -> None:
    rows = [model for model in MODELS if isinstance(model, ModbusModel)]
    ids = [(model.family, model_id) for model in rows for model_id in model.ids]
    assert len(ids) == len(set(ids))


@pytest.mark.parametrize(
    ("model_id", "name"),
    [
        (60061, "RD6006"),
        (60062, "RD6006"),
        (60065, "RD6006P"),
        (60066, "RK6006"),
        (60121, "RD6012"),
        (60125, "RD6012P"),
        (60181, "RD6018"),
        (60241, "RD6024"),
        (60301, "RD6030"),
    ],
)
def test_an_id_gives_its_model(model_id: int, name: str) -> None:
    assert model_with_id("riden", model_id).name == name


def test_the_p_models_count_ten_times_finer() -> None:
    for name in ("RD6006", "RD6012"):
        plain, fine = model_named(name), model_named(f"{name}P")
        assert plain.voltage_step_V == 10 * fine.voltage_step_V


@pytest.mark.parametrize("model_id", [60060, 60063, 60067, 60122, 60128, 60185, 60249, 60302])
def test_an_id_that_no_source_names_is_refused_with_the_known_ones(model_id: int) -> None:
    words = rf"id {model_id} is not known.*RD6006 60061, 60062; RD6006P 60065; RK6006 60066"
    with pytest.raises(HardwareError, match=words):
        model_with_id("riden", model_id)


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"no supply model 'RD9000'; there are RD6006, RD6006P"):
        model_named("RD9000")


FORBIDDEN = {"riden": {*range(54, 63), 256}, "hanmatek": {0x9999, 0xC110, 0xC11E, 0xC120, 0xC12E}}


def test_calibration_and_boot_loader_are_never_written() -> None:
    for model in MODELS:
        if isinstance(model, ModbusModel):
            assert not model.registers.writable & FORBIDDEN.get(model.family, set())
            assert len(model.registers.writable) == 5  # V, A, output and two trip levels


def test_no_other_read_is_as_long_as_a_block_that_clears_a_suspect_line() -> None:
    for own in (RIDEN_REGISTERS, DPS_REGISTERS, HANMATEK_REGISTERS):
        (_, one), (_, other) = own.marks
        lengths = {own.trips.count}
        for block in own.status:
            lengths |= set(range(block.count, block.count + block.spare + 1))
        assert one != other
        assert not {one, other} & lengths
