"""Held runs and hops each show a cause of their own: both are named, and one model has them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.diagnose.hidden import DOCUMENT, SHAPE, Asked, runs_of, truth
from workbench.diagnose import HopperRig, diagnose
from workbench.investigate.remaining import remaining

DRAG, FORWARD = 0.03, 0.008
ASKED = (
    Asked("decay", 0.3, 3.0),
    Asked("decay", 0.8, 3.0),
    Asked("decay", 0.5, 3.0, "held_out"),
    Asked("hop", 17.0, 4.0),
    Asked("hop", 18.5, 4.0),
    Asked("hop", 19.0, 4.0, "held_out"),
)


@pytest.mark.budget(140)  # 95 s, and twice that on a processor of 2 GHz
def test_what_a_held_foot_shows_and_what_hops_alone_show_are_named_together(tmp_path: Path) -> None:
    effects = {"air_drag": {"c": DRAG}, "foot_cg": {"forward": FORWARD}}
    robot = truth(3, effects, off=0.02, increments=32)
    rig = HopperRig(runs_of(robot, 3, ASKED), DOCUMENT, SHAPE, increments=32)
    found = diagnose(rig, tmp_path, threads=1)
    print(found)
    assert found.kind == "NAMED"
    assert list(found.parts) == ["held foot", "hops", "drive"]
    assert [found.parts[name].best.names for name in ("held foot", "hops")] == [
        ("air_drag",), ("foot_cg",)
    ]  # fmt: skip
    assert found.parts["drive"].kind == "CLEAN"
    drag, forward = (next(iter(one.quantities.values())) for one in found.causes)
    assert drag.low < DRAG < drag.high < 1.3 * DRAG
    assert forward.low < FORWARD < forward.high < 1.5 * FORWARD
    assert found.removed is not None
    assert found.removed > 0.9

    held, hops = found.observer.parts.values()
    assert len(held.base.blocks) == len(hops.base.blocks) == 2
    assert "foot_cg" not in {name for one in held.tried for name in one.names}
    assert "air_drag" not in {name for one in hops.tried for name in one.names}
    best = found.observer.best
    assert best.names == ("air_drag", "foot_cg")
    assert len(best.blocks) == 4
    assert best.values["foot_mass"] == hops.best.values["foot_mass"]
    assert [one.name for one in found.observer.refit] == [p.name for p in rig.base]
    assert found.extended is not None
    assert remaining(found, rig)[0].names == best.names
