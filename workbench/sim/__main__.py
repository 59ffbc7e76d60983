"""Compile the functions that simulations call, so that the first run does not wait for it.

python -m workbench.sim
"""

from pathlib import Path

import numpy as np

from workbench.schemas import load_model, load_shape
from workbench.sim import Condition, make_robot, simulate

__all__: list[str] = []

if __name__ == "__main__":
    model, shape = load_model("thesis", Path()), load_shape("thesis-initial", Path())
    robot = make_robot(model.content.values(), shape.content)
    simulate(robot, Condition("hop", np.full(2, 17.0)))
