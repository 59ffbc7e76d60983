"""The force at T that a robot's model misses in a run, and what it may depend on.

The smoother draws a force towards zero by as much as the cameras leave open (`fit.smoother`). About
the robot's rest it is a Wiener filter: with G what the channels make of modal forces of density q,
R the density of the cameras' noise and f the true force, at each frequency

    smoothed f = K (G f + noise),   K = q G' (G q G' + R)^-1

so that what it makes of a known force, and what the cameras' noise alone makes, are known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from workbench.diagnose.hypothesis import Hypothesis
from workbench.fit import WINDOW, Hopper, Modes, at_points, pose, smoothed
from workbench.motion import FOOT, ROTOR_ANGLE, TOP
from workbench.timeseries import TimeSeries

__all__ = ["CONTACT_M", "MissingForce", "Response", "force_of"]

Array = NDArray[np.float64]

CONTACT_M = 5e-4
"""A foot that is lower stands."""

_EDGE = 12  # samples at either end of a run, where a force rests on one side only
_BLIND = 12  # samples without a place, beyond which a force is a guess
_PITCH = 2  # of a free foot, after x and z
_PAD_S = 2.0  # behind a run: what a force does dies away
_SLOWEST = 0.1  # [1/s^2] and [1/s]: a mode without a spring gets these


@dataclass(frozen=True, eq=False)
class Response:
    """What a smoother makes of a force at T, and of noise.

    Args:
        shares: (f, 2, 2) smoothed over true force, forward and up, at each frequency [1].
        length: of the series that these frequencies belong to.
        noise: (2, 2) covariance of the smoothed force where only the cameras' noise is [N^2].
    """

    shares: NDArray[np.complex128]
    length: int
    noise: Array

    def of(self, values: Array) -> Array:
        """Return what is smoothed of forces forward, or up, (n, 2, 2, c) [unit of the values].

        The second axis is the direction of what is smoothed, the third that of the force.

        Args:
            values: (n, c) c forces [unit of the values].
        """
        found = np.fft.rfft(values, self.length, axis=0)
        moved = self.shares[:, :, :, None] * found[:, None, None, :]
        return np.asarray(np.fft.irfft(moved, self.length, axis=0)[: len(values)])


@dataclass(frozen=True, eq=False)
class MissingForce:
    """The force at T that the model misses in one run, means over 0.05 s.

    Args:
        run: its name.
        times: (n,) [s].
        force: (n, 2) forward and up [N].
        sigma: (n, 2) its standard deviation [N].
        information: (n, 2, 2) inverse of its covariance [N^-2].
        coordinates: name -> (n,) [SI], those that the run has.
        usable: (n,) samples that the cameras show.
        response: of the smoother.
    """

    run: str
    times: Array
    force: Array
    sigma: Array
    information: Array
    coordinates: Mapping[str, Array]
    usable: NDArray[np.bool_]
    response: Response

    @property
    def rms(self) -> float:
        """Return the root mean square of the force's size [N]."""
        return float(np.sqrt(np.mean(np.sum(self.force[self.usable] ** 2, axis=1))))


def force_of(base: Hypothesis, system: Hopper, k: int) -> MissingForce:
    """Return the force that a hypothesis misses in one run.

    Args:
        base: with its estimator, process noise and parameters.
        system: of the estimator.
        k: number of the run.
    """
    estimator, sample_s, run = base.estimator, system.sample_s, system.runs[k]
    found = estimator.innovations(base.x, keep=True)[k]
    gain, modes = estimator.gains[k], estimator.modes[k]
    smooth = smoothed(found, gain, modes, system.process(k, estimator.noise), sample_s)
    slopes, top = found.slopes[:, : len(run.places)], len(run.places) - 2
    if FOOT[0] in run.places:
        turn = np.broadcast_to(modes.basis[_PITCH], (len(slopes), 1, slopes.shape[2]))
        slopes = np.concatenate([slopes, turn], axis=1)
    force, covariance = at_points(smooth.force, smooth.force_covariance, slopes)
    covariance = covariance[:, top : top + 2, top : top + 2]
    half = modes.basis.shape[1]
    qpos = found.qpos + smooth.change[:, :half] @ modes.basis.T
    job, times = estimator.job(k, base.x), system.times(k)
    seen = np.isfinite(job.seen).all(axis=1)
    usable = scipy.ndimage.binary_dilation(seen, np.ones(2 * _BLIND + 1))
    usable[:_EDGE] = usable[len(usable) - _EDGE :] = False
    usable[found.sane :] = False
    motion = pose(system.robot, job.model, times, qpos, np.zeros(3))
    return MissingForce(
        run.name, times, force[:, top : top + 2],
        np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0)),
        np.asarray(np.linalg.inv(covariance), dtype=np.float64),
        _coordinates(motion, times, run.driven, FOOT[0] in run.places), usable,
        _response(modes, system.process(k, estimator.noise), system.sigma(k), sample_s,
                  len(times), (slopes[0], top), np.mean(smooth.force_covariance, axis=0)),
    )  # fmt: skip


def _response(
    modes: Modes, process: Array, sigma: Array, seconds: float, count: int,
    points: tuple[Array, int], covariance: Array,
) -> Response:  # fmt: skip
    """Return the response of the smoother about the robot's rest.

    On the ground it is another one: of a free foot a force's mean is taken for what is smoothed, so
    that sizes are what they are at least.

    Args:
        modes: of the observer.
        process: (nv,) process noise.
        sigma: (c,) of the channels.
        seconds: from one sample to the next.
        count: samples of the run.
        points: how foot and T move with the modes, (r, m), and which row is that of T forward.
        covariance: (m, m) of the smoothed modal force.
    """
    length = scipy.fft.next_fast_len(count + round(_PAD_S / seconds), real=True)
    w = 2 * np.pi * np.fft.rfftfreq(length, seconds)[:, None, None]
    drift = _SLOWEST * np.eye(len(modes.stiffness))
    force = modes.basis.T @ (process[:, None] ** 2 * modes.basis)
    dynamics = modes.stiffness + drift - w**2 * np.eye(len(drift))
    g = modes.slopes @ np.linalg.inv(dynamics + 1j * w * (modes.damping + drift))
    back = force @ g.conj().swapaxes(1, 2)
    noise = np.diag(sigma**2) * seconds
    k = back @ np.linalg.inv(g @ back + noise)
    slopes, top = points
    weighed = np.linalg.solve(covariance, slopes.T)
    at_top = np.linalg.solve(slopes @ weighed, weighed.T)[top : top + 2]
    mean = np.sinc(w / (2 * np.pi) * WINDOW * seconds)
    response = mean * (at_top @ k)
    density = (response @ noise @ response.conj().swapaxes(1, 2)).real
    total = (2 * density.sum(axis=0) - density[0]) / (length * seconds)
    shares = np.asarray(mean * np.eye(2) if top else response @ g @ slopes[top : top + 2].T)
    shares = shares.astype(np.complex128)
    return Response(shares, length, total)


def _coordinates(motion: TimeSeries, times: Array, driven: bool, free: bool) -> dict[str, Array]:
    """Return what a missing force may depend on, name -> (n,)."""
    rate = len(times) / (times[-1] - times[0])
    forward, up = motion[TOP[0]], motion[TOP[2]]
    found = {
        "time": times,
        "displacement forward": forward - np.mean(forward),
        "displacement up": up - np.mean(up),
        "velocity forward": np.gradient(forward) * rate,
        "velocity up": np.gradient(up) * rate,
    }
    if driven:
        found["rotor's angle"] = motion[ROTOR_ANGLE]
    if free:
        height = motion[FOOT[2]] - motion[FOOT[2]][0]
        found["foot's height"] = height
        found["slip speed"] = np.gradient(motion[FOOT[0]]) * rate * (height < CONTACT_M)
    return found
