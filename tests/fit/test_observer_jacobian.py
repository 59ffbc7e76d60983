"""The observer's own Jacobians are those of the engine."""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco.batch import Batch

from workbench.fit.observer import _jacobians

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


def test_jacobians_of_hinges_slides_and_a_free_joint_are_the_engine_s() -> None:
    for text in (CHAIN, FREE):
        model = mujoco.MjModel.from_xml_string(text)
        batch = Batch(model, nsim=2, nthread=1, persistent=True)
        batch.bind("qpos")[:, -3:] = [[0.4, -0.7, 0.2], [1.0, 0.3, -0.5]]
        batch.forward(stage=int(mujoco.mjtStage.mjSTAGE_VEL))
        bodies = np.array([model.body("end").id, model.body("aside").id], dtype=np.int64)
        points = batch.bind("xpos")[:, bodies] + [0.1, 0.2, 0.3]
        found = np.empty((2, 6, model.nv))
        _jacobians(batch, batch.bind("xanchor"), bodies)(points, found)
        for p, body in enumerate(bodies):
            engine = batch.jac(int(body), points[:, p])[0]
            np.testing.assert_allclose(found[:, 3 * p : 3 * p + 3], engine, atol=1e-12)
