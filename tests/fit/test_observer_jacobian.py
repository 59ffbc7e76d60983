"""The observer's own Jacobians are those of the engine."""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco.batch import Batch

from workbench.fit.correction import translations
from workbench.fit.observer import _translating

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


def batch_of(text: str) -> Batch:
    batch = Batch(mujoco.MjModel.from_xml_string(text), nsim=2, nthread=1, persistent=True)
    batch.bind("qpos")[:, -3:] = [[0.4, -0.7, 0.2], [1.0, 0.3, -0.5]]
    batch.forward(stage=int(mujoco.mjtStage.mjSTAGE_VEL))
    return batch


def test_jacobians_of_hinges_and_slides_are_the_engine_s() -> None:
    batch = batch_of(CHAIN)
    bodies = np.array([batch.model.body(name).id for name in ("end", "aside")], dtype=np.int64)
    points = batch.bind("xpos")[:, bodies] + [0.1, 0.2, 0.3]
    found = np.empty((2, 6, batch.model.nv))
    given = _translating(batch, batch.bind("xanchor"), bodies)
    assert given is not None
    translations(points, *given, found)
    for p, body in enumerate(bodies):
        engine = batch.jac(int(body), points[:, p])[0]
        np.testing.assert_allclose(found[:, 3 * p : 3 * p + 3], engine, atol=1e-12)


def test_those_of_a_free_joint_are_left_to_the_engine() -> None:
    batch = batch_of(CHAIN.replace('<joint type="slide" axis="1 0 0"/>', "<freejoint/>"))
    assert _translating(batch, batch.bind("xanchor"), np.array([1])) is None
