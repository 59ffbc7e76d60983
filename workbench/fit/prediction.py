"""How well a model predicts a run: from the estimated state, over stated times ahead.

A free simulation of the whole run mixes what the motor did otherwise than commanded, where the
robot was released, what the model misses, and after some hops chaos. A prediction starts
where the robot was seen to be and is driven as it was seen to turn: what it is off is the model's.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit.measured import MeasuredRun
from workbench.fit.state import Observed, observed
from workbench.fit.systems.hopper import Hopper
from workbench.sim import Robot, Stepper, keep_engine_quiet

__all__ = ["HORIZONS", "Horizon", "prediction_errors", "predictions"]

Array = NDArray[np.float64]

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_CURRENT = int(mujoco.mjtStage.mjSTAGE_VEL)
_SETTLED_S = 0.3  # after the first sample, before the first start: the observer has forgotten it
_LAST = 0.1  # share of a horizon, at its end, over which the error is taken


class Horizon(NamedTuple):
    """A time ahead [s], and how many starts are predicted so far; longer ones add theirs."""

    seconds: float
    starts: int


HORIZONS = (Horizon(0.1, 16), Horizon(0.5, 4), Horizon(2.0, 4))
"""Where nothing is missing and the noise makes 0.4 mm, these are 0.4 mm off clamped, in hops 0.5 to
1.0 mm, in coarse steps 0.7 to 1.9 mm: a landing is predicted from an uncertain speed."""


def prediction_errors(one: Observed, horizons: Sequence[Horizon] = HORIZONS) -> dict[float, float]:
    """Return horizon [s] -> root mean square distance from where foot and T were seen [mm].

    A start is the state that the samples up to it say; the rotor turns as measured. The error is
    that over the last tenth of the horizon, of the points that are observed, camera noise included;
    NaN where the run is too short or nothing was seen, infinite where the numbers blow up.

    Args:
        one: the observed run, whose model and steps predict.
        horizons: in order of time.
    """
    first, last = round(_SETTLED_S / one.system.sample_s), len(one.job.seen) - 1
    ahead = [round(horizon.seconds / one.system.sample_s) for horizon in horizons]
    lives: dict[int, int] = {}
    for horizon, samples in zip(horizons, ahead, strict=True):
        if last - samples > first:
            starts = np.linspace(first, last - samples, horizon.starts)
            lives |= {round(k): samples for k in starts}
    squares = _squares(one, lives)
    return {
        horizon.seconds: _root_mm(
            [
                square[round((1 - _LAST) * samples) : samples]
                for square in squares
                if len(square) >= samples
            ]
        )
        for horizon, samples in zip(horizons, ahead, strict=True)
    }


def predictions(robot: Robot, run: MeasuredRun) -> dict[str, float]:
    """Return time ahead [s] -> error of predictions [mm], in coarse steps.

    Nothing where the model cannot follow the run; a horizon that the run is too short for is left
    out.
    """
    try:
        errors = prediction_errors(observed(Hopper(robot, [run]), coarse=True))
    except InputError:
        return {}
    return {f"{s:g}": float(mm) for s, mm in errors.items() if np.isfinite(mm)}


def _squares(one: Observed, lives: Mapping[int, int]) -> list[Array]:
    """Return the squared distances of the points, (samples, p) [m^2], of each start.

    Args:
        one: the observed run.
        lives: sample of the start -> samples that it is predicted for.
    """
    job, rows = one.job, sorted(lives, key=lambda k: -lives[k])
    if not rows:
        return []
    keep_engine_quiet()
    batch = Batch(job.model, nsim=len(rows), nthread=1, persistent=True)
    for row, state in enumerate(_starts(one, rows)):
        batch.state[row] = state
    batch.forward(stage=_CURRENT)
    models, chains = [job.model] * len(rows), [job.chain] * len(rows)
    stepper = Stepper(batch, models, chains, places_alone=True)
    observation, points = job.observation, 2 * len(job.observation.bodies)
    qpos, command = batch.bind("qpos"), batch.bind("ctrl")
    apart = np.full((len(rows), lives[rows[0]], points), np.nan)
    starts, ends = np.array(rows), np.array([lives[k] for k in rows])
    last = len(job.seen) - 1
    for j in range(ends[0]):
        going = np.arange(np.count_nonzero(ends > j), dtype=np.int32)
        command[going] = job.control[starts[going] + j]
        stepper.step(job.steps, going)
        flat = stepper.xpos[:, observation.bodies].reshape(len(rows), -1)
        seen = flat @ observation.mix.T + qpos @ observation.pick.T + observation.bias
        apart[going, j] = (job.seen[np.minimum(starts + j + 1, last)] - seen)[going, :points]
        apart[stepper.broken, j] = np.inf
    pairs = np.sum(apart.reshape(*apart.shape[:2], -1, 2) ** 2, axis=3)
    return [pairs[row, :end] for row, end in enumerate(ends)]


def _starts(one: Observed, rows: Sequence[int]) -> Iterator[Array]:
    """Yield mjSTATE_INTEGRATION of the filtered states; corners find their hold anew."""
    job = one.job
    qpos, qvel = one.states(one.smoothed.filtered)
    turned = np.concatenate([[0.0], np.cumsum(job.control[:-1, 0])]) * one.system.sample_s
    data = mujoco.MjData(job.model)
    for k in rows:
        mujoco.mj_setState(job.model, data, job.state, _STATE)
        data.qpos[:], data.qvel[:] = qpos[k], qvel[k]
        data.qacc_warmstart[:] = one.innovations.qacc[k]
        data.act[:] += turned[k]
        data.userdata[:] = 0.0
        state = np.empty(len(job.state))
        mujoco.mj_getState(job.model, data, state, _STATE)
        yield state


def _root_mm(squares: Sequence[Array]) -> float:
    """Return the root of the mean of all that was seen [mm], NaN of nothing."""
    all_of_them = np.concatenate([np.zeros(0), *(square.ravel() for square in squares)])
    seen = all_of_them[~np.isnan(all_of_them)]
    return 1000 * float(np.sqrt(seen.mean())) if len(seen) else float("nan")
