"""The linearisation against the textbook's double pendulum."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from workbench.fit.systems.mjcf_model import linearised

DOUBLE = """
<mujoco>
  <worldbody>
    <body>
      <joint axis="0 1 0" damping="0.1" frictionloss="0.5"/>
      <inertial pos="0 0 -0.4" mass="1" diaginertia="1e-9 1e-9 1e-9"/>
      <body pos="0 0 -0.4">
        <joint axis="0 1 0" stiffness="2"/>
        <inertial pos="0 0 -0.2" mass="0.5" diaginertia="1e-9 1e-9 1e-9"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def test_a_double_pendulum_has_its_textbook_matrices_whatever_rubs():
    model = mujoco.MjModel.from_xml_string(DOUBLE)
    data = mujoco.MjData(model)
    mass, stiffness, damping = linearised(model, data)
    m1, m2, l1, l2, g = 1.0, 0.5, 0.4, 0.2, 9.81
    inner = m2 * l2**2
    outer = m2 * l1 * l2
    assert mass == pytest.approx(
        np.array([[(m1 + m2) * l1**2 + 2 * outer + inner, inner + outer], [inner + outer, inner]]),
        rel=1e-6,
    )
    weights = m2 * g * l2
    assert stiffness == pytest.approx(
        np.array([[(m1 + m2) * g * l1 + weights, weights], [weights, weights + 2]]), rel=1e-5
    )
    assert damping == pytest.approx(np.diag([0.1, 0.0]), abs=1e-6)
    assert model.dof_frictionloss[0] == 0.5
