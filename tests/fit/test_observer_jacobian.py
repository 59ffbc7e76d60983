"""The observer's own Jacobians are those of the engine."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from workbench.fit.gain import Gain
from workbench.fit.observation import Observation
from workbench.fit.observer import Job, SampleInnovations, Together

STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
CHAIN = """
<mujoco>
  <worldbody>
    <body name="cart"><joint type="slide" axis="1 0 0"/><geom size="0.1"/>
      <body name="arm" pos="0.1 0 0.2"><joint axis="0 1 0"/><geom size="0.1" pos="0.3 0 0"/>
        <body name="end" pos="0.5 0.1 0"><joint axis="0 0.6 0.8"/><geom size="0.1"/></body>
      </body>
      <body name="aside"><joint axis="1 0 0"/><geom size="0.1"/></body>
    </body>
  </worldbody>
</mujoco>
"""
FREE = CHAIN.replace('<joint type="slide" axis="1 0 0"/>', "<freejoint/>")
OFFSETS = np.array([[0.1, 0.2, 0.3], [0.2, -0.1, 0.1]])


def corrected(model: mujoco.MjModel, state: np.ndarray, bodies: np.ndarray) -> Together:
    """Two simulations of a model, corrected by a sample in which nothing was seen."""
    observation = Observation(bodies, OFFSETS, np.eye(6), np.zeros((6, model.nq)), np.zeros(6))
    still = Gain(np.eye(model.nv)[:, :2], np.eye(4), np.ones(6), np.zeros(6), np.zeros(6))
    none = np.zeros((1, model.nu))
    job = Job(model, state, none, observation, 1, seen=np.full((1, 6), np.nan), gain=still)
    together = Together([job, job])
    together.correct(np.full((2, 6), np.nan), SampleInnovations.of(2, 6, 2))
    return together


@pytest.mark.parametrize(("text", "own"), [(CHAIN, True), (FREE, False)], ids=["own", "engine"])
def test_jacobians_of_hinges_slides_and_a_free_joint_are_the_engine_s(text: str, own: bool) -> None:
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[-3:] = [0.4, -0.7, 0.2]
    mujoco.mj_forward(model, data)
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    bodies = np.array([model.body("end").id, model.body("aside").id], dtype=np.int64)
    together = corrected(model, state, bodies)
    assert (together._translating is not None) == own
    engine = np.empty((3, model.nv))
    for p, (body, offset) in enumerate(zip(bodies, OFFSETS, strict=True)):
        point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ offset
        mujoco.mj_jac(model, data, engine, None, point, body)
        for found in together._jacobian[:, 3 * p : 3 * p + 3]:
            np.testing.assert_allclose(found, engine, atol=1e-12)
