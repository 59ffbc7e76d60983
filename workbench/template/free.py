"""The angles of the free strip where a shape lists those of the standing robot."""

from __future__ import annotations

from dataclasses import replace

from workbench.schemas import ModelFile, ShapeFile
from workbench.sim import applied, make_robot, unloaded

__all__ = ["free_angles", "free_shape"]


def free_angles(shape: ShapeFile, model: ModelFile) -> tuple[float, ...]:
    """Return alpha_0 to alpha_15 of the free strip [rad].

    A shape that is `unloaded` lists them. For one that is `loaded` the twin's statics take off
    every hinge the bend that gravity causes there.

    Args:
        shape: as listed.
        model: of the robot that the strip is for, with its effects; a drift of the rest shape
            befell another strip and is left out.
    """
    if shape.state == "unloaded":
        return shape.angles
    robot = make_robot(model.values(), shape, model.increments, model.quantities())
    return unloaded(replace(applied(robot), drift=())).angles


def free_shape(shape: ShapeFile, model: ModelFile) -> ShapeFile:
    """Return a shape as the free strip has it; arguments as for `free_angles`."""
    return shape.model_copy(update={"angles": free_angles(shape, model), "state": "unloaded"})
