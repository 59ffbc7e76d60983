"""The neighbourhood: least cost and standard errors where residuals are straight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from workbench.fit.linear import Linear, edges_of
from workbench.fit.parameters import Known, beyond

COUNT, TRUTH = 1200, 3.0
EDGES = edges_of(COUNT, 1 / 120)


def linear(memory: float = 0.0, seed: int = 0) -> Linear:
    """Residuals of noise and of a cause of size 3 that a second, released number explains."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=COUNT)
    for k in range(1, COUNT):
        noise[k] = memory * noise[k - 1] + np.sqrt(1 - memory**2) * noise[k]
    slopes = np.column_stack([np.ones(COUNT), np.sin(np.arange(COUNT) / 50)])
    residuals = noise + slopes @ np.array([0.5, TRUTH])
    own = np.zeros(2, dtype=np.bool_)
    return Linear(("base", "cause"), own, np.zeros(2), residuals, -slopes, EDGES)


def test_a_released_number_reaches_its_size_and_one_with_a_prior_is_drawn_to_it() -> None:
    near = linear()
    found = near.solved({"base": True, "cause": False})
    assert found.x[1] == pytest.approx(TRUTH, abs=0.15)
    assert found.cost < near.solved({"base": True}).cost - 1000
    assert found.blocks.sum() + found.x[0] ** 2 == pytest.approx(found.cost)


def test_what_does_not_move_stays() -> None:
    held = linear().solved({"base": True})
    assert held.x[1] == 0.0
    assert held.deviation[1] == 0.0


@pytest.mark.parametrize("memory", [0.0, 0.9])
def test_errors_count_what_noise_remembers(memory: float) -> None:
    every = [linear(memory, seed).solved({"base": True, "cause": False}) for seed in range(60)]
    off = np.array([(one.x[1] - TRUTH) / one.deviation[1] for one in every])
    assert 0.7 < off.std() < 1.5


def test_a_second_is_a_block_and_a_short_run_has_four() -> None:
    assert len(EDGES) - 1 == COUNT / 120
    assert list(edges_of(100, 1 / 120)) == [0, 25, 50, 75, 100]


def test_what_runs_do_not_tell_from_a_stated_number_stays_small() -> None:
    near = linear()
    alike = near.jacobian[:, [0, 0, 1]]
    two = Linear(("base", "same", "cause"), np.zeros(3, dtype=np.bool_), np.zeros(3),
                 near.residuals, alike, EDGES)  # fmt: skip
    found = two.solved({"base": True, "same": False, "cause": False})
    alone = near.solved({"base": True, "cause": False})
    assert found.x[0] + found.x[1] == pytest.approx(alone.x[0], abs=0.01)
    # along what the runs do not distinguish, the slopes of both priors balance
    weight = 2 / (1 + found.x[1] ** 2)
    assert found.x[0] == pytest.approx(weight * found.x[1], rel=0.05)
    assert found.x[2] == pytest.approx(alone.x[1], abs=0.01)


def test_a_fall_is_what_is_solved_less_what_the_released_pay() -> None:
    near, moving = linear(), {"base": True, "cause": False}
    found = near.solved(moving)
    quadratic = near.residuals + near.jacobian @ found.x
    fitted = np.sum(near.weights * (near.residuals**2 - quadratic**2))
    fall = fitted - found.x[0] ** 2 - beyond(found.x[1:])[0]
    assert near.fall(moving) == pytest.approx(fall)


@pytest.mark.parametrize("size", [1.0, 1e4, 1e8])
@pytest.mark.parametrize("speed", [10.0, 13.37, 17.0])
def test_numbers_that_do_exactly_the_same_are_solved_for(size: float, speed: float) -> None:
    near = linear()
    column = size * near.jacobian[:, 1:]
    alike = np.hstack([near.jacobian[:, :1], column, speed * column])
    three = Linear(("base", "cause", "same"), np.zeros(3, dtype=np.bool_), np.zeros(3),
                   near.residuals, alike, EDGES)  # fmt: skip
    found = three.solved({"base": True, "cause": False, "same": False})
    assert size * (found.x[1] + speed * found.x[2]) == pytest.approx(TRUTH, abs=0.2)


def test_runs_that_follow_others_say_what_all_together_do() -> None:
    """What the first half says of the numbers is the prior beside the second."""
    whole = linear()
    half, moving = COUNT // 2, {"base": True, "cause": True}
    edges = EDGES[: np.searchsorted(EDGES, half) + 1]
    assert edges[-1] == half
    first = replace(whole, residuals=whole.residuals[:half], jacobian=whole.jacobian[:half],
                    edges=edges)  # fmt: skip
    found = first.solved(moving)
    root = np.asarray(np.linalg.cholesky(first.curvature + np.eye(2)).T, dtype=np.float64)
    known = Known(first.names, found.x, root)
    second = replace(whole, residuals=whole.residuals[half:], jacobian=whole.jacobian[half:],
                     edges=EDGES[len(edges) - 1 :] - half, known=known)  # fmt: skip
    after, every = second.solved(moving), whole.solved(moving)
    assert after.x == pytest.approx(every.x, rel=0.02)  # robust weights are those at zero
    alone = replace(second, known=None).solved(moving)
    assert np.abs(alone.x - every.x).max() > 10 * np.abs(after.x - every.x).max()
    pulled = after.x - known.at
    cost = after.blocks.sum() + pulled @ known.precision @ pulled
    assert after.cost == pytest.approx(cost)
    fall = second.fall(moving)
    left = second.residuals + second.jacobian @ after.x
    fitted = np.sum(second.weights * (second.residuals**2 - left**2))
    before = known.at @ known.precision @ known.at
    assert fall == pytest.approx(fitted + before - pulled @ known.precision @ pulled)


def test_an_error_grows_to_what_it_were_with_others_free_within_their_tolerances() -> None:
    """It holds what others do that have 0.15 of their tolerance, three times the error alone."""
    rng = np.random.default_rng(4)
    time = np.arange(COUNT) / 50
    slopes = np.column_stack([np.ones(COUNT), np.sin(time), np.sin(time + 0.3), np.cos(7 * time)])
    names, own = ("base", "cause", "alike", "unlike"), np.zeros(4, dtype=np.bool_)
    moving, off, grown = {"base": True, "cause": False}, list[float](), list[float]()
    for _ in range(200):
        hidden = np.array([0.5, TRUTH, *rng.normal(scale=0.15, size=2)])
        residuals = rng.normal(size=COUNT) + slopes @ hidden
        near = Linear(names, own, np.zeros(4), residuals, -slopes, EDGES)
        found, wider = near.solved(moving), near.wider(moving, ["alike", "unlike"])
        off.append((found.x[1] - TRUTH) / found.deviation[1])
        grown.append(off[-1] / wider["cause"])
        assert near.wider(moving, [])["cause"] == 1.0
        assert near.wider(moving, ["unlike"])["cause"] < 1.1
    assert np.std(off) > 2.5
    assert 0.75 < np.std(grown) < 1.25
