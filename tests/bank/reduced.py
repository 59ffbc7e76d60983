"""The fixed draw of reduced cases: a small one of every kind, and the others.

Four hidden effects, a pair, a null and a cause outside the library, most of them from the
independent engine; the slow ones of it and the others are diagnosed in the long tests. Their runs
are stored in `tests/data/bank` (`python -m benchmarks.bank.stored` writes them anew).
"""

from __future__ import annotations

from benchmarks.bank.cases import Block, Case, Source

__all__ = ["CASES", "FURTHER", "SMALL_DRAW"]


def _case(
    seed: int,
    block: Block,
    source: Source,
    sizes: tuple[float, ...],
    *amounts: tuple[str, str, float],
) -> Case:
    """Return a case whose causes were sized once: that takes as long as a diagnosis.

    Args:
        seed: of its robot and runs.
        block: kind of case.
        source: of its motions.
        sizes: of its causes, in noise deviations (`test_the_causes_have_their_size`).
        amounts: (cause, quantity, amount).
    """
    causes = tuple(dict.fromkeys(cause for cause, _, _ in amounts))
    return Case(seed, block, source, "S+D", "A", causes, sizes, reduced=True, amounts=amounts)


SMALL_DRAW = (
    _case(1, "single", "twin", (2.8,), ("hinge_cubic_stiffness", "k3", -397.32856558764246)),
    _case(2, "single", "rod", (1.3,), ("hinge_quadratic_damping", "c", 0.025498049453436946)),
    _case(3, "single", "twin", (2.0,), ("motor_droop", "slope", 42.29234321041852)),
    _case(4, "single", "rod", (2.8,), ("speed_ripple", "cos_2", 0.12)),
    _case(9, "pair", "twin", (1.5, 3.0), ("hinge_cubic_stiffness", "k3", 204.16374312310853),
          ("speed_ripple", "cos_2", 0.1421312942735996)),
    _case(11, "null", "rod", ()),
    _case(13, "outside", "rod", (1.0,), ("eccentric_gear", "angle", 0.03)),
)  # fmt: skip

FURTHER = (
    _case(5, "single", "twin", (1.8,), ("tether", "stiffness", 0.709994329228965)),
    _case(6, "single", "rod", (1.6,), ("hinge_cubic_stiffness", "k3", 202.7300786330503)),
    _case(12, "outside", "rod", (3.0,), ("viscoelastic_strip", "share", 0.015),
          ("viscoelastic_strip", "time", 0.1)),
    _case(10, "null", "twin", ()),
)  # fmt: skip

CASES = (*SMALL_DRAW, *FURTHER)
