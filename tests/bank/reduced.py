"""The fixed draw of reduced cases that every test run diagnoses.

Seven runs of four seconds each; six hidden effects, a pair, two nulls and a cause outside the
library, half of them from the independent engine.
"""

from __future__ import annotations

from tests.bank.cases import Block, Case, Source

__all__ = ["CASES"]


def _case(
    seed: int, block: Block, source: Source, *causes: str, sizes: tuple[float, ...] = ()
) -> Case:
    sizes = sizes or (3.0,) * len(causes)
    return Case(seed, block, source, "S+D", "A", causes, sizes, reduced=True)


CASES = (
    _case(1, "single", "twin", "hinge_cubic_stiffness"),
    _case(2, "single", "rod", "hinge_quadratic_damping"),
    _case(3, "single", "twin", "motor_droop"),
    _case(4, "single", "rod", "speed_ripple"),
    _case(5, "single", "twin", "tether"),
    _case(6, "single", "rod", "hinge_cubic_stiffness"),
    _case(9, "pair", "twin", "hinge_cubic_stiffness", "speed_ripple"),
    _case(10, "null", "twin"),
    _case(11, "null", "rod"),
    _case(12, "outside", "rod", "viscoelastic_strip"),
)
