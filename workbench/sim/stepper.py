"""Step the simulations of a batch: planar chains by compiled lines, all others by the engine."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray

from workbench.sim.chain import Chain, read_chain
from workbench.sim.chain_step import step_chains

__all__ = ["Stepper"]

_CURRENT = int(mujoco.mjtStage.mjSTAGE_VEL)
_STATE = ("qpos", "qvel", "userdata")


class Stepper:
    """Steps a batch; what is bound of it is that of the state after the step, as with `mj_step1`.

    Both ways step alike, to rounding. A chain takes five times less: see `chain`.

    Args:
        batch: whose models are set and whose state is forwarded to `mjSTAGE_VEL`.
        models: of its simulations, in their order.

    Attributes:
        broken: (s,) simulations whose numbers blew up; what they hold is no motion any more.
        torque: (s, nu) of the actuators in the step before [N m].
    """

    def __init__(self, batch: Batch, models: Sequence[mujoco.MjModel]) -> None:
        self._batch = batch
        self.broken = np.zeros(batch.nsim, dtype=np.bool_)
        self.torque = batch.bind("actuator_force")
        self._chains = chains = _chains(models)
        if chains is None:
            return
        self.torque = self.torque.copy()
        self._numbers = tuple(
            np.array([getattr(chain, name) for chain in chains])
            for name in ("links", "motors", "ground", "laws", "top", "gravity", "step")
        )
        self._state = tuple(batch.bind(name) for name in _STATE)
        self._kept = [part.copy() for part in self._state]

    @property
    def by_chain(self) -> bool:
        """Return whether the compiled lines step it."""
        return self._chains is not None

    def step(self, steps: int, rows: NDArray[np.int32] | None = None) -> None:
        """Step some simulations, or all.

        Args:
            steps: of the engine.
            rows: which.
        """
        if self._chains is None:
            with suppress(SimulationError):  # the engine's own warnings count below
                self._batch.step(ids=rows, nstep=steps, stage=_CURRENT)
            warned = (self._batch.warning[:, :, 1] != 0).any(axis=1)
            self.broken |= (self._batch.status != 0) | warned
            return
        batch, (qpos, qvel, userdata) = self._batch, self._state
        # a state that is corrected between two steps has new forces; one that is not, has had them
        same = np.all(
            [(a == b).all(axis=1) for a, b in zip(self._state, self._kept, strict=True)], axis=0
        )
        step_chains(
            *self._numbers, self._chains[0].root,
            np.arange(batch.nsim) if rows is None else rows.astype(np.int64),
            qpos, qvel, batch.bind("act"), batch.bind("ctrl"), userdata, same, steps, self.torque,
            self.broken,
        )  # fmt: skip
        batch.bind("time")[:] += steps * self._numbers[-1]
        batch.forward(ids=rows, stage=_CURRENT)
        for kept, part in zip(self._kept, self._state, strict=True):
            kept[:] = part


def _chains(models: Sequence[mujoco.MjModel]) -> list[Chain] | None:
    """Return the chains that models are, None where one is none or they are unlike."""
    found: list[Chain] = []
    for model in models:
        chain = read_chain(model)
        if chain is None or (found and chain.layout != found[0].layout):
            return None
        found.append(chain)
    return found
