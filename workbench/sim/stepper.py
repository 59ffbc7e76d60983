"""Step the simulations of a batch: planar chains by compiled code, all others by the engine."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray

from workbench.sim.chain import PlanarChain, read_chain
from workbench.sim.chain_links import blocks_of
from workbench.sim.chain_step import step_chains

__all__ = ["Stepper"]

_PARTS = ("qpos", "qvel", "act", "ctrl", "userdata", "time", "qacc_warmstart")
_CURRENT = int(mujoco.mjtStage.mjSTAGE_VEL)


class Stepper:
    """Steps a batch; its bound arrays are those of the state after the step, as with `mj_step1`.

    Both ways agree to rounding. Eight chains take half of the engine's time for one.

    Args:
        batch: whose models are set and whose state is forwarded to `mjSTAGE_VEL`.
        models: of its simulations, in their order.
        chains: planar chains that are stepped in the models' places; of each None takes that of the
            model, where it is one.
        places_alone: whether after a step only `xpos`, `xmat` and `xanchor` of this object are
            needed, and of the batch only its state: a chain computes them in a tenth of the
            engine's time.

    Attributes:
        xpos: (s, nbody, 3) positions of the bodies [m].
        xmat: (s, nbody, 9).
        xanchor: (s, njnt, 3) of hinges [m].
        broken: (s,) simulations that diverged; their states are not valid.
        torque: (s, nu) of the actuators in the step before [N m].
    """

    def __init__(
        self,
        batch: Batch,
        models: Sequence[mujoco.MjModel],
        chains: Sequence[PlanarChain | None] = (),
        *,
        places_alone: bool = False,
    ) -> None:
        self._batch, self._models, self._places_alone = batch, list(models), places_alone
        self._engines = tuple(batch.bind(name) for name in ("xpos", "xmat", "xanchor"))
        self.xpos, self.xmat, self.xanchor = (each.copy() for each in self._engines)
        self.broken = np.zeros(batch.nsim, dtype=np.bool_)
        self.torque = np.zeros((batch.nsim, batch.model.nu))
        self._torque = batch.bind("actuator_force")
        self._spans = np.array([_span(batch, name) for name in _PARTS])
        self._forced = np.full_like(batch.state, np.nan) if places_alone else batch.state.copy()
        self._all = np.arange(batch.nsim, dtype=np.int32)
        self._every = np.ones(batch.nsim, dtype=np.bool_)
        chains = chains or [None] * len(models)
        unread = [m for m, chain in zip(models, chains, strict=True) if chain is None]
        read = {id(model): read_chain(model) for model in {id(one): one for one in unread}.values()}
        chains = [c or read[id(m)] for m, c in zip(models, chains, strict=True)]
        self._by_chain = np.array([chain is not None for chain in chains])
        self._only_chains = bool(self._by_chain.all())
        some = next((chain for chain in chains if chain is not None), None)
        if some is None:
            return
        whole = [chain or some for chain in chains]  # rows of other models are not used
        self._root = some.root
        self._numbers = {
            name: np.array([getattr(chain, name) for chain in whole])
            for name in ("actuators", "ground", "laws", "top", "gravity", "step", "ahead")
        }
        self._blocks = blocks_of(np.array([chain.links for chain in whole]))
        self._bodies = np.array([chain.bodies for chain in whole])

    def chains(self, steps: int) -> tuple[Any, ...] | None:
        """Return what `step_chains` takes for all simulations; None where the engine steps some.

        Args:
            steps: of the engine.
        """
        return self._given(steps, self._every) if self._only_chains and self._places_alone else None

    def step(self, steps: int, rows: NDArray[np.int32] | None = None) -> None:
        """Step some simulations, or all.

        Args:
            steps: of the engine.
            rows: (k,) which; all where left out.
        """
        rows = self._all if rows is None else rows
        if self._only_chains:
            self._step_chains(steps, rows)
            return
        by_chain = self._by_chain[rows]
        if by_chain.any():
            self._step_chains(steps, rows[by_chain])
        if not by_chain.all():
            self._step_engine(steps, rows[~by_chain])

    def lead(self, seconds: NDArray[np.float64], steps: int) -> None:
        """Step some simulations through a time of their own.

        Args:
            seconds: (s,) how long; those of no time stay where they are.
            steps: of the engine in that time.
        """
        asked = np.flatnonzero(seconds > 0).astype(np.int32)
        by_chain = self._by_chain[asked]
        if by_chain.any():
            led, usual = asked[by_chain], {n: self._numbers[n].copy() for n in ("step", "ahead")}
            self._numbers["step"][led] = seconds[led] / steps
            self._numbers["ahead"][led] = 0.0  # as the engine's own steps
            self._step_chains(steps, led)
            for name, numbers in usual.items():
                self._numbers[name][:] = numbers
        if not by_chain.all():
            led, models = asked[~by_chain], [copy.copy(model) for model in self._models]
            for row in led:
                models[row].opt.timestep = seconds[row] / steps
            self._batch.set_models(models)
            self._step_engine(steps, led)
            self._batch.set_models(self._models)
            self._batch.forward(ids=led, stage=_CURRENT)

    def _step_engine(self, steps: int, rows: NDArray[np.int32]) -> None:
        with suppress(SimulationError):  # the engine's own warnings count below
            self._batch.step(ids=rows, nstep=steps, stage=_CURRENT)
        warned = (self._batch.warning[:, :, 1] != 0).any(axis=1)
        self.broken |= ((self._batch.status != 0) | warned) & ~self._by_chain
        self.torque[rows] = self._torque[rows]
        for own, engine in zip((self.xpos, self.xmat, self.xanchor), self._engines, strict=True):
            own[rows] = engine[rows]

    def _step_chains(self, steps: int, rows: NDArray[np.int32]) -> None:
        batch = self._batch
        asked = np.zeros(batch.nsim, dtype=np.bool_)
        asked[rows] = True
        step_chains(*self._given(steps, asked))
        if not self._places_alone:
            batch.forward(ids=None if rows is self._all else rows, stage=_CURRENT)
            self._forced[:] = batch.state

    def _given(self, steps: int, asked: NDArray[np.bool_]) -> tuple[Any, ...]:
        return (
            self._blocks, *self._numbers.values(), self._root, asked, self._batch.state,
            self._forced, self._spans, steps, self.torque, self.broken, self._bodies, self.xpos,
            self.xmat, self.xanchor,
        )  # fmt: skip


def _span(batch: Batch, name: str) -> tuple[int, int]:
    """Return begin and end of a part of the state in its row."""
    part, state = batch.bind(name), batch.state
    begin = (part.ctypes.data - state.ctypes.data) // state.itemsize
    return begin, begin + part[0].size
