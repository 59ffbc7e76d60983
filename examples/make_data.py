"""Make the data of the example rigs: own equations, solved by scipy, seen by a plain sensor.

    python examples/make_data.py

What the models in these folders do not know is named in `PENDULUM` and `CART`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

__all__ = [
    "CART",
    "PENDULUM",
    "Cart",
    "Pendulum",
    "main",
    "pendulum_run",
    "spring_run",
    "stamps",
    "sweep",
]

RATE_HZ = 100
REST_S = 1.0
GRAVITY = 9.81  # [m/s^2]
SEED = 20261121

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pendulum:
    """I q'' = -(m l + m_rod l / 2) g sin q - d q' - friction sign q'; dry friction is hidden.

    Args:
        mass: of the bob [kg].
        length: from pivot to bob [m].
        rod: mass of the rod [kg].
        bob_inertia: of the bob about its own centre [kg m^2].
        damping: [N m s/rad].
        friction: dry, of the pivot [N m].
        noise: of the encoder [rad].
        count: the angle that the encoder counts in [rad].
        duration: [s].
    """

    mass: float = 0.25
    length: float = 0.4
    rod: float = 0.05
    bob_inertia: float = 9e-5
    damping: float = 0.0004
    friction: float = 0.0015
    noise: float = 4e-4
    count: float = 2 * np.pi / 8192
    duration: float = 12.0


@dataclass(frozen=True)
class Cart:
    """m x'' = -k x - k3 x^3 - d x' + F; k3 and the sensor's delay are hidden.

    Args:
        mass: [kg].
        stiffness: [N/m].
        cubic: k3 [N/m^3].
        damping: [N s/m].
        delay: how late the place is seen [s].
        noise: of the place [m].
        count: the way that the sensor counts in [m].
        duration: [s].
    """

    mass: float = 0.5
    stiffness: float = 80.0
    cubic: float = 3000.0
    damping: float = 0.5
    delay: float = 0.004
    noise: float = 5e-5
    count: float = 2e-5
    duration: float = 10.0


PENDULUM, CART = Pendulum(), Cart()

_SHARP = 1e-4  # [rad/s] within which dry friction changes its sign
_FORCES = {"sweep-weak": 0.05, "sweep-middle": 0.1, "sweep-strong": 0.15}  # [N]
_BAND_HZ = (1.0, 4.0)
_RELEASED_M = 0.03


def pendulum_run(truth: Pendulum, angle: float, times: Array) -> Array:
    """Return the true angle at some times since the release, (n,) [rad]; held before it."""
    m, rod, length = truth.mass, truth.rod, truth.length
    inertia = m * length**2 + truth.bob_inertia + rod * length**2 / 3
    weight = (m + rod / 2) * GRAVITY * length

    def rates(_: float, y: Array) -> list[float]:
        dry = truth.friction * np.tanh(y[1] / _SHARP)
        return [y[1], -(weight * np.sin(y[0]) + truth.damping * y[1] + dry) / inertia]

    return _solved(rates, angle, times)


def spring_run(truth: Cart, force: Callable[[float], float], start: float, times: Array) -> Array:
    """Return the true place at some times since the release, (n,) [m]; held before it."""

    def rates(t: float, y: Array) -> list[float]:
        pulled = truth.stiffness * y[0] + truth.cubic * y[0] ** 3 + truth.damping * y[1]
        return [y[1], (force(t) - pulled) / truth.mass]

    return _solved(rates, start, times)


def sweep(amplitude: float, duration: float) -> Callable[[float], float]:
    """Return a force whose frequency rises evenly through the band, zero at its beginning."""
    low, high = _BAND_HZ

    def force(t: float) -> float:
        turns = low * t + (high - low) * t**2 / (2 * duration)
        return float(amplitude * np.sin(2 * np.pi * turns)) if t > 0 else 0.0

    return force


def stamps(duration: float) -> Array:
    """Return the stamps of a run, (n,) [s]; the release is at `REST_S`."""
    return np.arange(round((REST_S + duration) * RATE_HZ) + 1) / RATE_HZ


def main(folder: Path) -> None:
    """Write the data of both rigs below a folder."""
    random = np.random.default_rng(SEED)
    at = stamps(PENDULUM.duration)
    for angle in (0.2, 0.5, 0.7, 0.9):
        true = pendulum_run(PENDULUM, angle, at - REST_S)
        seen = _seen(true, PENDULUM.noise, PENDULUM.count, random)
        path = folder / "pendulum" / f"release-{angle:g}.csv"
        _write(path, "time_s,angle_rad", "%.2f,%.5f", at, seen)
    for name, amplitude in _FORCES.items():
        path = folder / "hardening_spring" / f"{name}.csv"
        _write_cart(path, sweep(amplitude, CART.duration), 0.0, random)
    path = folder / "hardening_spring" / "release.csv"
    _write_cart(path, sweep(0.0, CART.duration), _RELEASED_M, random)


def _write_cart(
    path: Path, force: Callable[[float], float], start: float, random: np.random.Generator
) -> None:
    at = stamps(CART.duration)
    true = spring_run(CART, force, start, at - REST_S - CART.delay)
    seen = 1000 * _seen(true, CART.noise, CART.count, random)
    forces = np.array([force(t - REST_S) for t in at])
    _write(path, "time_s,place_mm,force_N", "%.2f,%.2f,%.5f", at, seen, forces)


def _solved(rates: Callable[[float, Array], list[float]], start: float, times: Array) -> Array:
    """Return the first of two states, which begins at rest at time zero."""
    moving = times > 0
    after = np.concatenate([[0.0], times[moving]])
    found = solve_ivp(
        rates, (0, after[-1]), [start, 0.0], method="LSODA", t_eval=after, rtol=1e-10, atol=1e-11,
        max_step=1 / RATE_HZ,
    )  # fmt: skip
    path = np.full(len(times), start)
    path[moving] = found.y[0, 1:]
    return path


def _seen(true: Array, noise: float, count: float, random: np.random.Generator) -> Array:
    return np.round((true + random.normal(0, noise, len(true))) / count) * count


def _write(path: Path, head: str, form: str, *columns: Array) -> None:
    np.savetxt(path, np.column_stack(columns), fmt=form, header=head, comments="", newline="\n")


if __name__ == "__main__":
    main(Path(__file__).parent)
