"""The fixed draw of reduced cases that every test run diagnoses.

Seven runs of four seconds each; six hidden effects, a pair, two nulls and a cause outside the
library, half of them from the independent engine.
"""

from __future__ import annotations

from benchmarks.bank.cases import Block, Case, Source

__all__ = ["CASES", "SIZE"]

SIZE = 3.0
"""Of every cause here, in noise deviations (`test_the_causes_have_their_size`)."""


def _case(seed: int, block: Block, source: Source, *amounts: tuple[str, str, float]) -> Case:
    """Return a case whose causes were sized once: that takes as long as a diagnosis."""
    causes = tuple(dict.fromkeys(cause for cause, _, _ in amounts))
    sizes = (SIZE,) * len(causes)
    return Case(seed, block, source, "S+D", "A", causes, sizes, reduced=True, amounts=amounts)


CASES = (
    _case(1, "single", "twin", ("hinge_cubic_stiffness", "k3", -126.73084714830395)),
    _case(2, "single", "rod", ("hinge_quadratic_damping", "c", 0.025498049453436946)),
    _case(3, "single", "twin", ("motor_droop", "slope", 42.29234321041852)),
    _case(4, "single", "rod", ("speed_ripple", "cos_2", 0.12)),
    _case(5, "single", "twin", ("tether", "stiffness", 0.709994329228965)),
    _case(6, "single", "rod", ("hinge_cubic_stiffness", "k3", 202.7300786330503)),
    _case(9, "pair", "twin", ("hinge_cubic_stiffness", "k3", 204.16374312310853),
          ("speed_ripple", "cos_2", 0.1421312942735996)),
    _case(10, "null", "twin"),
    _case(11, "null", "rod"),
    _case(12, "outside", "rod", ("viscoelastic_strip", "share", 0.015),
          ("viscoelastic_strip", "time", 0.1)),
)  # fmt: skip
