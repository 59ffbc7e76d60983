"""What every effect promises: absent at zero, seen where it says, nowhere else, and told apart."""

from __future__ import annotations

import re
import runpy
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from tests.sim.rigs import with_effect
from workbench.errors import InputError
from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, TOP, Mode
from workbench.sim import (
    EFFECTS,
    SAMPLE_RATE_HZ,
    Condition,
    Effect,
    Group,
    Quantity,
    Robot,
    simulate,
    simulate_all,
)

NAMES: dict[Group, str] = {
    "structure": "hinge_stiffness root_stiffness hinge_cubic_stiffness root_play "
    "local_stiffness_loss rest_shape_drift",
    "dissipation": "hinge_damping hinge_coulomb_friction hinge_quadratic_damping air_drag",
    "mass": "top_mass foot_mass foot_cg rotor_unbalance",
    "drive": "speed_scale speed_offset speed_drift motor_droop speed_ripple",
    "ground": "ground_slope ground_stiffness ground_damping ground_hunt_crossley friction_level "
    "friction_anisotropy friction_wait sole_adhesion",
    "outside": "tether",
    "sensor": "camera_tilt time_offset length_scale marker_offset",
    "numerics": "beam_discretisation time_step",
}
"""Every name that an effect may have, by group."""

SEEN = (*FOOT, PITCH, *TOP, *ROTOR, ROTOR_ANGLE)
CONDITIONS: dict[Mode, Condition] = {
    "clamped": Condition("clamped", np.full(181, 13.0)),
    "decay": Condition("decay", np.zeros(121), pull=0.4),
    "hop": Condition("hop", np.full(121, 17.0)),
    "drop": Condition("drop", np.zeros(121), height=0.02),
}
ROUNDING = 1e-12  # [m, rad] a mass that is never moved changes the last digits of the solver
PAIRS = [(e, q) for e in EFFECTS.values() for q in e.quantities]
by_quantity = pytest.mark.parametrize(
    ("effect", "quantity"), PAIRS, ids=[f"{e.name}-{q.name}" for e, q in PAIRS]
)
by_effect = pytest.mark.parametrize("effect", EFFECTS.values(), ids=list(EFFECTS))


def seen(robot: Robot, condition: Condition) -> np.ndarray:
    """Return what the cameras' stamps say, at the stamps of a robot that is seen on time."""
    motion = simulate(robot, condition).motion.select(SEEN)
    on_time = np.arange(len(motion)) / SAMPLE_RATE_HZ
    return np.column_stack([np.interp(on_time, motion.times, c) for c in motion.values.T])


@pytest.fixture(scope="module")
def bare(robot: Robot) -> dict[Mode, np.ndarray]:
    """The motion of the robot without effects, by mode."""
    return {mode: seen(robot, condition) for mode, condition in CONDITIONS.items()}


def moved(robot: Robot, bare: dict[Mode, np.ndarray], mode: Mode) -> float:
    """Return the greatest change of what is seen [m, rad]."""
    return float(np.abs(seen(robot, CONDITIONS[mode]) - bare[mode]).max())


@by_effect
def test_zero_is_absence_to_the_last_bit(
    robot: Robot, bare: dict[Mode, np.ndarray], effect: Effect
) -> None:
    absent = with_effect(robot, effect.name, **{q.name: 0.0 for q in effect.quantities})
    assert np.array_equal(seen(absent, CONDITIONS["hop"]), bare["hop"])


@by_quantity
def test_a_quantity_moves_the_modes_that_it_says_and_no_others(
    robot: Robot, bare: dict[Mode, np.ndarray], effect: Effect, quantity: Quantity
) -> None:
    there = with_effect(robot, effect.name, **{quantity.name: quantity.tolerance})
    for mode in get_args(Mode):
        change = moved(there, bare, mode)
        if mode in effect.excited_by:
            assert change > 1e-5, f"{mode}: moved by {change} only"
        else:
            assert change < ROUNDING, f"{mode}: moved by {change}"


@by_quantity
def test_an_effect_vanishes_with_its_quantity(
    robot: Robot, bare: dict[Mode, np.ndarray], effect: Effect, quantity: Quantity
) -> None:
    """What comes with an effect, a solver or a law, does nothing of its own."""
    if quantity.unit == "1" and quantity.step >= 1:
        pytest.skip("a count has no small value")
    faint = with_effect(robot, effect.name, **{quantity.name: 1e-6 * quantity.tolerance})
    mode = effect.excited_by[0]
    assert moved(faint, bare, mode) < 1e-6


def difference(
    robot: Robot, effect: Effect, quantity: Quantity, step: float, condition: Condition
) -> np.ndarray:
    """Return a finite difference, central where the quantity may be negative."""
    low = -step if quantity.low < 0 else 0.0
    sides = [
        seen(with_effect(robot, effect.name, **{quantity.name: value}), condition)
        for value in (step, low)
    ]
    return (sides[0] - sides[1]) / (step - low)


@by_quantity
def test_a_finite_difference_may_take_its_step(
    robot: Robot, effect: Effect, quantity: Quantity
) -> None:
    """Thrice the step gives the same; a hop only up to its first slip, which is a jump."""
    if quantity.unit == "1" and quantity.step >= 1:
        pytest.skip("a count has no small value")
    mode = effect.excited_by[0]
    short = replace(CONDITIONS[mode], command=CONDITIONS[mode].command[:90])
    condition = short if mode == "hop" else CONDITIONS[mode]
    small, large = (
        difference(robot, effect, quantity, factor * quantity.step, condition) for factor in (1, 3)
    )
    apart = np.linalg.norm(large - small) / np.linalg.norm(small)
    print(f"{effect.name} {quantity.name}: {apart:.4f} apart in {mode}")
    assert apart < 0.05


def test_effects_mix_in_a_batch_to_the_same_bits(robot: Robot) -> None:
    """Whatever flags and laws their models have."""
    robots = [robot] + [
        with_effect(robot, e.name, **{q.name: q.tolerance for q in e.quantities})
        for e in EFFECTS.values()
    ]
    modes: tuple[Mode, ...] = ("clamped", "hop")
    shorter = [replace(CONDITIONS[mode], command=CONDITIONS[mode].command[:20]) for mode in modes]
    jobs = [(r, condition) for condition in shorter for r in robots]
    together = simulate_all(jobs, threads=2)
    for job, found in zip(jobs, together, strict=True):
        assert np.array_equal(simulate(*job).motion.values, found.motion.values)


def test_the_order_of_the_effects_is_the_library_s(robot: Robot) -> None:
    given = {e.name: {e.quantities[0].name: e.quantities[0].tolerance} for e in EFFECTS.values()}
    backward = dict(reversed(given.items()))
    paths = [
        seen(replace(robot, effects=effects), CONDITIONS["clamped"])
        for effects in (given, backward)
    ]
    assert np.array_equal(paths[0], paths[1])


def test_a_quantity_out_of_its_bounds_is_refused(robot: Robot) -> None:
    wrong = with_effect(robot, "root_play", gap=-0.001)
    with pytest.raises(
        InputError, match=r"root_play: gap is -0\.001 rad; it must lie within 0 and"
    ):
        simulate(wrong, CONDITIONS["decay"])


@by_effect
def test_an_effect_is_told_in_full(effect: Effect) -> None:
    assert effect.name in NAMES[effect.group].split()
    assert set(re.findall(r"{(\w+)[:}]", effect.sentence)) == {q.name for q in effect.quantities}
    assert effect.excited_by
    assert effect.confused_with
    assert effect.separated_by
    for q in effect.quantities:
        assert q.low <= 0 < q.step <= q.tolerance <= q.high


@by_effect
def test_a_size_is_told_with_the_word_for_its_sign(effect: Effect) -> None:
    sizes = re.findall(r"{(\w+):size}", effect.sentence)
    assert set(sizes) <= set(re.findall(r"{(\w+):\w[^}]*\|\w[^}]*}", effect.sentence))


@by_effect
def test_effects_are_confused_with_one_another(effect: Effect) -> None:
    names = " ".join(NAMES.values()).split()
    assert effect.name not in effect.confused_with
    for other in effect.confused_with:
        assert other in names
        if other in EFFECTS:
            assert effect.name in EFFECTS[other].confused_with, f"{other} does not name it back"


def test_the_library_is_in_the_order_of_the_groups() -> None:
    groups: Iterator[Group] = (e.group for e in EFFECTS.values())
    places = [list(NAMES).index(group) for group in groups]
    assert places == sorted(places)


def test_the_page_of_effects_is_that_of_the_library(root: Path) -> None:
    written = (root / "docs" / "reference" / "effects.md").read_text(encoding="utf-8")
    page = runpy.run_path(str(root / "docs" / "make_effects.py"))["page"]
    assert written == page(), "run `make effects`"
