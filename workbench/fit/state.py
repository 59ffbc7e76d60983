"""The estimated state of the hopping robot: its whole pose over a run, and the force it misses.

Nobody sees the beam; the observer's model, corrected at foot and T, says where it is. What the
model would need in addition to do as the robot did is the missing force.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit.gain import Modes, stationary
from workbench.fit.observer import Innovations, Job, observe
from workbench.fit.parameters import Parameter
from workbench.fit.smoother import Smoothed, at_points, smoothed
from workbench.fit.systems.hopper import Hopper
from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, ROTOR_SPEED, TOP
from workbench.motion import rotor_angle as angle_of
from workbench.motion import rotor_speed as speed_of
from workbench.quantities import unit_of
from workbench.sim import Robot, hinge_name
from workbench.timeseries import TimeSeries

__all__ = ["Observed", "estimated_state", "observed", "pose", "start_foot", "state_of"]

Array = NDArray[np.float64]

_PASSES = 2
_PITCH_DOF = 2  # of a free foot, after its x and z
_BLIND = 12  # samples to the nearest one seen, beyond which a state is a guess
_FOLLOWED_M = 0.02  # greatest root mean square of one-sample predictions that follow anything
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


@dataclass(frozen=True, eq=False)
class Observed:
    """One run as the observer went through it.

    Args:
        system: of the run, its rotor turned as it was seen.
        run: its number.
        job: that was observed.
        innovations: of it, with the states before each correction.
        modes: of the gain.
        smoothed: what all samples say of the state.
    """

    system: Hopper
    run: int
    job: Job
    innovations: Innovations
    modes: Modes
    smoothed: Smoothed

    def states(self, change: Array) -> tuple[Array, Array]:
        """Return positions [m, rad] and velocities [m/s, rad/s], (n, nv) each, after a change.

        Args:
            change: (n, 2 m) of the modes' coordinates and rates [m sqrt(kg), m sqrt(kg)/s].
        """
        basis, half = self.modes.basis.T, len(self.modes.stiffness)
        qpos, qvel = self.innovations.qpos, self.innovations.qvel
        return qpos + change[:, :half] @ basis, qvel + change[:, half:] @ basis


def estimated_state(
    system: Hopper,
    run: int = 0,
    values: Mapping[Parameter, float] | None = None,
    noise: Mapping[str, float] | None = None,
    passes: int = _PASSES,
) -> TimeSeries:
    """Return the whole pose of the robot over a run, and the force that its model misses.

    Channels of `workbench.motion` and `hinge_K_rad`, all of one chain, places against the foot's at
    the start. A `*_sigma_*` is the standard deviation of the channel of that name:

    - `foot_x_m`, `hinge_K_rad` and the like: what cameras and missing forces leave uncertain.
    - `beam_K_sigma_m`: the same of the place of joint K in the plane; the last is the beam's tip.
    - `missing_mode_K_N_per_sqrt_kg`: missing modal force of the observer's modes, their mass one.
    - `missing_top_x_N`, `missing_top_z_N`, of a free foot `missing_foot_x_N`, `missing_foot_z_N`
      and `missing_foot_pitch_N_m`: the forces on T and foot that explain the modal ones best
      (`smoother.at_points`), as if nothing else were missing.

    A missing force is the mean over 0.05 s around its sample, given the samples and `noise` as the
    prior: it is drawn towards zero by as much as the cameras leave open. Its deviation is that of a
    foot in the air; on the ground, which pushes back, forces on the foot are less sure: where
    nothing is missing they lie within two deviations in 9 samples of 10. A sample is not valid
    where the cameras saw too little around it.

    Args:
        system: with the run.
        run: its number.
        values: of the parameters that are not nominal.
        noise: process noise of each group of joints; the strong one where left out.
        passes: observations; after each but the last the rotor's angle against T is taken anew from
            the estimated turn of T.

    Raises:
        InputError: when the run cannot be observed.
    """
    return state_of(observed(system, run, values, noise, passes))


def observed(
    system: Hopper,
    run: int = 0,
    values: Mapping[Parameter, float] | None = None,
    noise: Mapping[str, float] | None = None,
    passes: int = _PASSES,
    coarse: bool = False,
) -> Observed:
    """Observe a run and smooth what was found; arguments as of `estimated_state`.

    Args:
        system: with the run.
        run: its number.
        values: of the parameters that are not nominal.
        noise: process noise of each group of joints; the strong one where left out.
        passes: observations of a driven run; those before the last are coarse.
        coarse: whether the last is coarse as well.

    Raises:
        InputError: when the run cannot be observed.
    """
    modes, process = system.modes(run), system.process(run, noise or system.strong)
    gain = stationary(modes, process, system.sigma(run), system.sample_s, system.memory(run))

    def job(coarse: bool) -> Job:
        start = system.start(run, values or {}, coarse)
        return Job.of(start, system.seen(run), gain)

    for _ in range(passes - 1 if system.runs[run].driven else 0):
        (found,) = observe([job(coarse=True)], threads=1, keep=True)
        _require_followed(system, run, found)
        system = _turned(system, run, found.qpos)
    last = job(coarse)
    (found,) = observe([last], threads=1, keep=True)
    _require_followed(system, run, found)
    smooth = smoothed(found, gain, modes, process, system.sample_s)
    return Observed(system, run, last, found, modes, smooth)


def state_of(one: Observed) -> TimeSeries:
    """Return the estimated state of an observed run, as `estimated_state` has it."""
    smooth, run = one.smoothed, one.system.runs[one.run]
    times = one.system.times(one.run)
    robot, origin = one.system.robot, start_foot(one.job)
    whole = pose(robot, one.job.model, times, one.states(smooth.change)[0], origin)
    columns = {name: whole[name] for name in whole.names} | _beam_sigmas(one)
    slopes, names = one.innovations.slopes[:, : len(run.places)], [*run.places]
    if FOOT[0] in names:
        turn = np.broadcast_to(one.modes.basis[_PITCH_DOF], (len(times), 1, slopes.shape[2]))
        slopes, names = np.concatenate([slopes, turn], axis=1), [*names, PITCH]
    half = slopes.shape[2]
    spread = slopes @ smooth.covariance[:, :half, :half] @ slopes.swapaxes(1, 2)
    for name, sigma in zip(names, _deviations(spread).T, strict=True):
        columns[_sigma(name)] = sigma
    force, covariance = at_points(smooth.force, smooth.force_covariance, slopes)
    columns |= _with_sigmas([_missing(name) for name in names], force, covariance)
    modal = [f"missing_mode_{k}_N_per_sqrt_kg" for k in range(half)]
    columns |= _with_sigmas(modal, smooth.force, smooth.force_covariance)
    seen = _near_seen(one.job.seen)
    return TimeSeries.of(times, columns, dict.fromkeys(columns, seen))


def _beam_sigmas(one: Observed) -> dict[str, Array]:
    """Return the standard deviation of each hinge angle [rad] and of each joint's place [m].

    A chain in the plane: turning a joint at (x, z) moves the point (X, Z) beyond it by
    (Z - z, -(X - x)) for each radian.
    """
    model, basis, robot = one.job.model, one.modes.basis, one.system.robot
    half = basis.shape[1]
    covariance = one.smoothed.covariance[:, :half, :half]
    listed = [k for k, hinge in enumerate(robot.hinges) if hinge.stiffness is not None]
    joints = [model.joint(hinge_name(k)) for k in listed]
    turning = [int(joint.qposadr[0]) for joint in joints]
    chain = [int(model.jnt_bodyid[joint.id]) for joint in joints]
    if turning[0] > _PITCH_DOF:  # a free foot turns about its centre of gravity
        turning, chain = [_PITCH_DOF, *turning], [model.body("foot").id, *chain]
    data, qpos = mujoco.MjData(model), one.states(one.smoothed.change)[0]
    places = np.empty((len(qpos), len(chain) + 1, 2))
    for n, angles in enumerate(qpos):
        data.qpos[:] = angles
        mujoco.mj_kinematics(model, data)
        places[n] = data.xpos[[*chain, model.body("top").id]][:, [0, 2]]
    turns = basis[turning]  # (j, m)
    whole = np.concatenate([np.zeros((1, half)), np.cumsum(turns, axis=0)])  # of the joints before
    arms = np.cumsum(turns[None, :, :, None] * places[:, :-1, None, :], axis=1)
    arms = np.concatenate([np.zeros_like(arms[:, :1]), arms], axis=1)
    moved = whole[None, :, :, None] * places[:, :, None, :] - arms  # (n, j + 1, m, 2)
    slopes = np.stack([moved[..., 1], -moved[..., 0]], axis=2)  # (n, j + 1, 2, m)
    if turning[0] == _PITCH_DOF:
        slopes += basis[:2]
    spread = np.sqrt(np.maximum(np.einsum("njam,nmk,njak->nj", slopes, covariance, slopes), 0.0))
    spread = spread[:, -len(listed) - 1 :]
    sigma = np.sqrt(np.maximum(np.einsum("im,nmk,ik->ni", basis, covariance, basis), 0.0))
    count, still = len(robot.hinges), np.zeros(len(qpos))
    angle = dict(zip(listed, sigma[:, turning[-len(listed) :]].T, strict=True))
    return {f"{hinge_name(k)}_sigma_rad": angle.get(k, still) for k in range(count)} | {
        f"beam_{k}_sigma_m": one for k, one in zip((*listed, count), spread.T, strict=True)
    }


def pose(
    robot: Robot, model: mujoco.MjModel, times: Array, qpos: Array, origin: Array
) -> TimeSeries:
    """Return the motion of a planar robot from its joints.

    Args:
        robot: that moved.
        model: of it.
        times: (n,) [s].
        qpos: (n, nq) [m, rad].
        origin: (3,) taken off all places [m].
    """
    data = mujoco.MjData(model)
    foot, top, site = model.body("foot").id, model.body("top").id, model.site("rotor").id
    places = np.empty((len(times), 3, 3))
    for k, joints in enumerate(qpos):
        data.qpos[:] = joints
        mujoco.mj_kinematics(model, data)
        places[k] = data.xpos[foot], data.xpos[top], data.site_xpos[site]
    columns: dict[str, Array] = {}
    for point, names in enumerate((FOOT, TOP, ROTOR)):
        columns |= dict(zip(names, (places[:, point] - origin).T, strict=True))
    columns[ROTOR_ANGLE] = angle_of(places[:, 1], places[:, 2])
    columns[ROTOR_SPEED] = speed_of(times, columns[ROTOR_ANGLE])
    free = model.nq > 1 + sum(hinge.stiffness is not None for hinge in robot.hinges)
    columns[PITCH] = qpos[:, _PITCH_DOF] if free else np.zeros(len(times))
    for k, hinge in enumerate(robot.hinges):
        locked = hinge.stiffness is None
        joint = None if locked else model.joint(hinge_name(k)).qposadr[0]
        columns[f"{hinge_name(k)}_rad"] = (
            np.full(len(times), hinge.angle) if joint is None else qpos[:, joint]
        )
    return TimeSeries.of(times, columns)


def start_foot(job: Job) -> Array:
    """Return the place of the foot where a job starts, (3,) [m]."""
    data = mujoco.MjData(job.model)
    mujoco.mj_setState(job.model, data, job.state, _STATE)
    mujoco.mj_kinematics(job.model, data)
    return np.asarray(data.body("foot").xpos.copy(), dtype=np.float64)


def _turned(system: Hopper, run: int, qpos: Array) -> Hopper:
    """Return the system with this run's rotor angle taken anew."""
    turned = list(system.turned)
    turned[run] = system.angle_against_top(run, qpos)
    return system.turning(turned)


def _require_followed(system: Hopper, run: int, found: Innovations) -> None:
    name, count = system.names[run], len(found.error)
    if found.sane < count:
        raise InputError(
            f"{name}: the observed model blew up {found.sane * system.sample_s:.2f} s after the "
            "first sample; check model, shape and take"
        )
    seen = _near_seen(system.seen(run))
    if 2 * np.count_nonzero(seen) < count:
        share = 100 * np.count_nonzero(seen) / count
        raise InputError(f"{name}: foot and T were seen in only {share:.0f} % of the run")
    places = found.error[:, : len(system.runs[run].places)]
    apart = float(np.sqrt(np.nanmean(places**2)))
    if not apart < _FOLLOWED_M:
        raise InputError(
            f"{name}: the model does not follow the robot; one sample ahead it is "
            f"{1000 * apart:.0f} mm off (root mean square)"
        )


def _near_seen(seen: Array) -> NDArray[np.bool_]:
    """Return where every channel was seen within a tenth of a second, (n,)."""
    wide = np.pad(np.isfinite(seen), ((_BLIND, _BLIND), (0, 0)))
    near = np.any(sliding_window_view(wide, 2 * _BLIND + 1, axis=0), axis=2)
    return np.asarray(np.all(near, axis=1))


def _with_sigmas(names: list[str], values: Array, covariance: Array) -> dict[str, Array]:
    columns: dict[str, Array] = {}
    for name, value, sigma in zip(names, values.T, _deviations(covariance).T, strict=True):
        columns[name], columns[_sigma(name)] = value, sigma
    return columns


def _deviations(covariance: Array) -> Array:
    return np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0))


def _sigma(name: str) -> str:
    """Return the name of a channel's deviation: `sigma` before the unit."""
    unit, _ = unit_of(name)
    return f"{name.removesuffix(unit)}_sigma{unit}"


def _missing(name: str) -> str:
    """Return what the force along a place is called, the moment along an angle."""
    unit, _ = unit_of(name)
    return f"missing_{name.removesuffix(unit)}{'_N_m' if unit == '_rad' else '_N'}"
