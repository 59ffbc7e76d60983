"""The observer on a stream: each sample as it comes, nothing known of those that follow.

The same compiled steps as those of a whole track (`observer.Together`). What a track's observer
takes from the future is replaced by what is known so far:

- The rotor is an input. Its angle against T is tracked by a Kalman filter of angle, speed and
  acceleration, and the model is driven by what the filter predicts of the next sample.
- The missing force is smoothed over the last samples alone.

**The prediction error** is how far the model is off some time ahead: every third sample a
simulation starts from the state that was corrected by then; nothing corrects it, and it is driven
as the rotor was seen to turn. 0.1 s later, and for the two samples after that, it is compared with
what is seen: the greater of the distances at foot and T, in the hopping plane; that of a clamped
foot is from its rest. One-sample predictions would not do: a strong correction makes them good
whatever the robot does.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit.gain import Gain, Modes, stationary
from workbench.fit.measured import MeasuredRun
from workbench.fit.observer import Innovations, Job, SampleInnovations, Together
from workbench.fit.smoother import WINDOW, at_points, smoothed
from workbench.fit.systems.hopper import Hopper
from workbench.fit.systems.hopper_view import View
from workbench.motion import DRIVEN, FOOT, PITCH, ROTOR_ANGLE, Mode, seen_median
from workbench.sim import Robot, applied
from workbench.timeseries import TimeSeries

__all__ = ["AHEAD", "LEAST_REST", "Estimate", "OnlineObserver", "PointForces"]

Array = NDArray[np.float64]

AHEAD = 12
"""Samples over which the model predicts freely before it is compared: 0.1 s."""
LEAST_REST = 60
"""Samples at rest from which the observer starts."""

_EVERY = 3  # samples from one simulation that predicts to the next
_PREDICTING = AHEAD // _EVERY + 1
_GATE_M, _GATE_RAD = 0.02, 0.2  # beyond it a sample is a glitch, unless four in a row are
_JERK = 20.0
"""[rad/s^3 sqrt(s)] of the rotor against T. Its angle is the one in the world less T's estimated
turn, which it moves: from some 100 on, what is not known of the turn is fed back and grows."""
_LEAST_NOISE_RAD = 4e-3  # less would do as a greater jerk does
_FORCE_SAMPLES = 12  # that a missing force is smoothed over; 48 change that of T by a tenth
_SETTLED = 36  # samples after a long gap until the observer has forgotten it


@dataclass(frozen=True, eq=False)
class Estimate:
    """What is known after one sample.

    Args:
        qpos: (nq,) corrected pose of the model [m, rad].
        predicted: (nq,) pose [m, rad] that was predicted 0.1 s before; None while none is that old.
        error_m: the prediction error [m], NaN where a point was not seen or nothing was predicted.
    """

    qpos: Array
    predicted: Array | None
    error_m: float


@dataclass(frozen=True)
class PointForces:
    """Forces that the model misses, at points of it.

    Args:
        samples_ago: how old the sample is that they are about.
        force: point -> (forward, up) [N].
        sigma: point -> their standard deviations [N].
    """

    samples_ago: int
    force: Mapping[str, tuple[float, float]]
    sigma: Mapping[str, tuple[float, float]]


class OnlineObserver:
    """Observes a driven robot sample by sample, from its rest on.

    Args:
        robot: the model.
        mode: hop or clamped.
        rest: channels of `workbench.motion` at even samples at rest, the newest last.

    Attributes:
        channels: names of what a sample holds, in order.

    Raises:
        InputError: when there is too little rest, a point is not seen there, or the robot cannot be
            simulated.
    """

    def __init__(self, robot: Robot, mode: Mode, rest: TimeSeries) -> None:
        if mode not in DRIVEN:
            raise InputError(f"mode {mode} has no drive; only driven runs are observed live")
        if len(rest) < LEAST_REST:
            raise InputError(f"{len(rest)} samples at rest; an observer needs {LEAST_REST}")
        run = MeasuredRun("the stream", mode, _before_zero(rest))
        angle = np.where(rest.validity(ROTOR_ANGLE), rest[ROTOR_ANGLE], np.nan)
        still = float(np.nanmedian(angle))
        if not np.isfinite(still):
            raise InputError("T and rotor were not seen together at rest")
        run = replace(run, start_angle=still)
        self._system = system = Hopper(robot, [run], turned=[None], coloured={})
        system = system.turning([np.full(len(system.seen(0)), still)])
        self.channels = system.channels_of(0)
        modes, process = system.modes(0), system.process(0, system.strong)
        gain = stationary(modes, process, system.sigma(0), system.sample_s)
        start = system.start(0, {}, coarse=True)
        none = np.zeros((0, len(self.channels)))
        gate = np.array([_GATE_RAD if name == PITCH else _GATE_M for name in self.channels])
        free = replace(gain, covariance=np.zeros_like(gain.covariance))
        jobs = [Job.of(start, none, gain, gate), *[Job.of(start, none, free)] * _PREDICTING]
        self._together, self._points = Together(jobs), len(run.places)
        self._found = SampleInnovations.of(len(jobs), len(self.channels), gain.basis.shape[1])
        self._ages = np.full(_PREDICTING, -1)  # of the simulations that predict, in samples
        self._age = 0
        view, radius = View.of(applied(robot).effects), robot.values["rotor_radius"]
        self._true_angle = lambda seen: float(view.true_angle(np.array(seen), radius))
        sigma = max(float(run.noise([ROTOR_ANGLE])[0]), _LEAST_NOISE_RAD)
        self._rotor = _Tracked(still, sigma, system.sample_s)
        self._act = self._true_angle(still)
        self._turn = self._turn_of_top()
        self._foot_at: dict[str, float] | None = None
        if FOOT[0] not in self.channels:
            at_rest = {name: rest[name][rest.validity(name)] for name in (FOOT[0], FOOT[2])}
            self._foot_at = {name: seen_median(values) for name, values in at_rest.items()}
        self._last = deque[tuple[Array, Array, Array]](maxlen=_FORCE_SAMPLES)
        self._smoothing: tuple[Gain, Modes, Array] = (gain, modes, process)

    @property
    def model(self) -> mujoco.MjModel:
        """Return the model that is stepped."""
        return self._together.batch.model

    def advance(self, sample: Mapping[str, float], samples: int = 1) -> Estimate:
        """Take the next sample.

        Args:
            sample: channel -> value as in `rest`, NaN where not seen; the rotor's angle is known up
                to whole turns.
            samples: how many samples after the last one: those between were lost or left out.
        """
        together, found = self._together, self._found
        seen = np.array([sample[name] for name in self.channels])
        wanted = self._true_angle(self._rotor.predict(samples))
        speed = (wanted - self._act) / (samples * self._system.sample_s)
        self._act = wanted
        rows = None
        if samples > AHEAD:  # none of the predictions can be judged, and the state is a guess
            self._ages[:], self._age, rows = -1, -_SETTLED, np.array([0], dtype=np.int32)
        together.step(np.full((len(found.error), self.model.nu), speed), samples, rows)
        self._ages[self._ages >= 0] += samples
        together.correct(np.broadcast_to(seen, found.error.shape).copy(), found)
        qpos = together.state[0]
        self._rotor.correct(sample[ROTOR_ANGLE] - (self._turn_of_top() - self._turn))
        self._last.append((found.error[0].copy(), found.slopes[0].copy(), qpos[0].copy()))
        if samples > 1:
            self._last.clear()
        old = int(np.argmax(self._ages))
        error, predicted = float("nan"), None
        if AHEAD <= self._ages[old] < AHEAD + _EVERY:
            apart = found.error[1 + old, : self._points].reshape(-1, 2)
            distances = [*np.hypot(*apart.T), *self._of_held_foot(sample)]
            error, predicted = float(np.max(distances)), qpos[1 + old].copy()
        self._begin(min(samples, AHEAD))
        return Estimate(qpos[0].copy(), predicted, error)

    def missing_force(self) -> PointForces | None:
        """Return the newest force that the model misses; None before there were enough samples."""
        if len(self._last) < _FORCE_SAMPLES:
            return None
        gain, modes, process = self._smoothing
        error, slopes, qpos = (np.array(part) for part in zip(*self._last, strict=True))
        empty = np.zeros(0)
        run = Innovations(error, empty, empty, slopes, self._together.rates(self._found.slopes)[0],
                          qpos, qpos, len(error))  # fmt: skip
        smooth = smoothed(run, gain, modes, process, self._system.sample_s)
        ago = WINDOW // 2
        at = slice(-1 - ago, -ago)
        moving = slopes[at, : self._points]
        force, covariance = at_points(smooth.force[at], smooth.force_covariance[at], moving)
        sigma = np.sqrt(np.maximum(np.diagonal(covariance[0]), 0.0))
        names = ["top"] if self._foot_at is not None else ["foot", "top"]
        pairs = ((float(a), float(b)) for a, b in (*force[0].reshape(-1, 2), *sigma.reshape(-1, 2)))
        found = list(pairs)
        return PointForces(
            ago,
            dict(zip(names, found[: len(names)], strict=True)),
            dict(zip(names, found[len(names) :], strict=True)),
        )

    def _of_held_foot(self, sample: Mapping[str, float]) -> list[float]:
        """Return how far a clamped foot is seen from its rest [m], where it is seen."""
        if self._foot_at is None:
            return []
        across, up = (sample[name] - at for name, at in self._foot_at.items())
        apart = float(np.hypot(across, up))
        return [apart] if np.isfinite(apart) else []

    def _begin(self, samples: int) -> None:
        """Let a simulation predict from the corrected state, every third sample."""
        self._age += samples
        done = self._ages >= AHEAD + _EVERY - 1
        self._ages[done] = -1
        if self._age < _EVERY:
            return
        self._age = 0
        row = int(np.argmin(self._ages))
        self._together.batch.state[1 + row] = self._together.batch.state[0]
        self._ages[row] = 0

    def _turn_of_top(self) -> float:
        """Return the turn of T in the corrected state [rad]."""
        held = FOOT[0] not in self.channels
        return float(self._together.state[0][0, 0 if held else 2 : -1].sum())


class _Tracked:
    """An angle that is tracked: Kalman filter of angle, speed and acceleration, white jerk.

    Args:
        angle: at rest [rad].
        sigma: of a measured angle [rad].
        seconds: of a sample.
    """

    def __init__(self, angle: float, sigma: float, seconds: float) -> None:
        t = seconds
        self._state, self._spread = np.array([angle, 0.0, 0.0]), np.diag([sigma**2, 1e-6, 1e-6])
        self._step = np.array([[1, t, t**2 / 2], [0, 1, t], [0, 0, 1]])
        last = [t**3 / 6, t**2 / 2, t]
        kick = [[t**5 / 20, t**4 / 8, last[0]], [t**4 / 8, t**3 / 3, last[1]], last]
        self._kick = _JERK**2 * np.array(kick)
        self._noise = sigma**2

    def predict(self, samples: int) -> float:
        """Predict the next sample and return its angle [rad]."""
        for _ in range(samples):
            self._state = self._step @ self._state
            self._spread = self._step @ self._spread @ self._step.T + self._kick
        return float(self._state[0])

    def correct(self, angle: float) -> None:
        """Take a measured angle [rad], known up to whole turns; NaN where not seen."""
        if not np.isfinite(angle):
            return
        off = angle - self._state[0]
        off -= 2 * np.pi * round(off / (2 * np.pi))
        gain = self._spread[:, 0] / (self._spread[0, 0] + self._noise)
        self._state = self._state + gain * off
        self._spread = self._spread - np.outer(gain, self._spread[0])


def _before_zero(rest: TimeSeries) -> TimeSeries:
    """Return a rest whose last sample is the one before time zero."""
    times = np.arange(-len(rest), 0) * Hopper.sample_s
    return TimeSeries(times.astype(np.float64), rest.values, rest.names, rest.valid)
