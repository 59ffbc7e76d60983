"""Play of the foot joint: a base without it softens so far that from there the gap does nothing."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.diagnose.hidden import DOCUMENT, SHAPE, Asked, runs_of, truth
from workbench.diagnose import HopperRig, diagnose

GAP = 0.0018
ASKED = (
    Asked("decay", 0.3, 3.0),
    Asked("decay", 0.8, 3.0),
    Asked("clamped", 9.0, 3.0),
    Asked("decay", 0.5, 3.0, "held_out"),
)


@pytest.mark.long  # 75 s of a core
def test_play_is_found_from_the_stated_numbers(tmp_path: Path) -> None:
    robot = truth(3, {"root_play": {"gap": GAP}})
    found = diagnose(HopperRig(runs_of(robot, 3, ASKED), DOCUMENT, SHAPE), tmp_path, threads=1)
    print(found)
    assert (found.kind, [one.name for one in found.causes]) == ("NAMED", ["root_play"])
    gap = found.causes[0].quantities["gap"]
    assert gap.value == pytest.approx(GAP, rel=0.1)
