"""Turns, speeds and their errors against angles that are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from workbench.errors import InputError
from workbench.tracking import mean_speed, turns, unwrapped

RATE = 120.0
SPEED = 17.0


def angle(t: np.ndarray, speed: float = SPEED) -> np.ndarray:
    """Return an angle that ripples once and twice a turn."""
    phase = 0.3 + speed * t
    return phase + 0.05 * np.sin(phase) + 0.02 * np.cos(2 * phase + 0.4)


def wrapped(phi: np.ndarray) -> np.ndarray:
    return np.angle(np.exp(1j * phi))


@pytest.mark.parametrize("speed", [17.0, -17.0, 21.0, 9.0])
@pytest.mark.parametrize("gap_s", [0.05, 0.3, 1.0, 2.0])
def test_turns_are_counted_across_gaps_of_a_steady_rotor(speed: float, gap_s: float) -> None:
    t = np.arange(1200) / RATE
    true = angle(t, speed)
    seen = wrapped(true)
    seen[(t > 3.0) & (t < 3.0 + gap_s)] = np.nan
    seen[(t > 7.0) & (t < 7.0 + gap_s)] = np.nan
    found = unwrapped(t, seen)
    known = np.isfinite(seen)
    off = found.angle[known] - true[known]
    np.testing.assert_allclose(off - off[0], 0.0, atol=1e-9)
    assert found.unresolved_s == ()
    assert np.isnan(found.angle[~known]).all()


def test_a_gap_while_the_speed_changes_by_more_than_a_turn_stays_unresolved() -> None:
    t = np.arange(1200) / RATE
    true = np.where(t < 5, 5.0 * t, 25.0 + 17.0 * (t - 5))
    seen = wrapped(true)
    seen[(t > 4.6) & (t < 5.8)] = np.nan
    found = unwrapped(t, seen)
    assert found.unresolved_s == pytest.approx((1.2,), abs=0.02)


def test_a_gap_that_the_speed_does_not_explain_stays_unresolved() -> None:
    t = np.arange(1200) / RATE
    seen = wrapped(angle(t) + np.where(t > 6, 2.4, 0.0))  # the rotor stood for a moment
    seen[(t > 5.5) & (t < 6.3)] = np.nan
    assert len(unwrapped(t, seen).unresolved_s) == 1


def test_a_rotor_at_rest_and_one_sample_have_no_gaps_to_resolve() -> None:
    t = np.arange(200) / RATE
    still = np.full(200, 1.0)
    still[50:100] = np.nan
    assert unwrapped(t, still)[1:] == (0, ())
    assert unwrapped(t[:1], still[:1]).angle.tolist() == [1.0]
    assert np.isnan(unwrapped(t, np.full(200, np.nan)).angle).all()


def test_each_turn_has_its_speed_and_turns_beside_gaps_are_left_out() -> None:
    t = np.arange(1200) / RATE
    phi = angle(t)
    whole = turns(t, phi)
    assert len(whole.speeds) == int(phi[-1] / (2 * np.pi)) - 1
    # the ripple repeats each turn, so a turn takes the time of an even one
    np.testing.assert_allclose(whole.speeds, SPEED, rtol=2e-4)
    np.testing.assert_allclose(turns(t, -phi).speeds, -SPEED, rtol=2e-4)
    holed = phi.copy()
    passage = int(np.argmax(phi > 10 * 2 * np.pi))
    holed[passage - 4 : passage + 4] = np.nan
    assert len(turns(t, holed).speeds) == len(whole.speeds) - 2


@pytest.mark.parametrize("memory_s", [0.0, 0.1])
def test_the_stated_error_of_the_mean_speed_covers(memory_s: float) -> None:
    rng = np.random.default_rng(5)
    t = np.arange(0, 10, 1 / RATE)
    keep = np.exp(-1 / (RATE * memory_s)) if memory_s else 0.0
    apart = []
    for _ in range(200):
        noise = lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.normal(0, 0.01, len(t)))
        phi = angle(t) + np.asarray(noise)
        phi[rng.random(len(t)) < 0.05] = np.nan
        found = mean_speed(t, phi)
        assert abs(found.value / SPEED - 1) < 1e-3
        apart.append((found.value - SPEED) / found.standard_error)
    # Student's t with few degrees of freedom; an error of white noise would give 4 with memory
    assert 0.8 < np.std(apart) < 1.4
    assert np.mean(np.abs(apart) < 2) > 0.85


def test_the_sign_is_that_of_the_angle() -> None:
    t = np.arange(0, 10, 1 / RATE)
    assert mean_speed(t, angle(t, -SPEED)).value == pytest.approx(-SPEED, rel=1e-4)
    assert mean_speed(t, angle(t), 2.0, 8.0).turns == pytest.approx(16.2, abs=0.1)


def test_too_few_turns_are_refused() -> None:
    t = np.arange(0, 1, 1 / RATE)
    with pytest.raises(InputError, match=r"seen over 2\.7 turns; a mean speed .* needs 3"):
        mean_speed(t, angle(t))
    with pytest.raises(InputError, match=r"seen over 0\.0 turns"):
        mean_speed(t, np.full(len(t), np.nan))
