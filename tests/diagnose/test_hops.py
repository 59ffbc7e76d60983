"""Hops that no model can foretell one by one are compared as what they are on the whole."""

from __future__ import annotations

import re
from dataclasses import dataclass
from html import unescape
from typing import cast

import pytest

from tests.diagnose.hidden import DOCUMENT, SHAPE, Asked, runs_of, truth
from workbench.diagnose import Diagnosis, HopperRig
from workbench.diagnose.hops import HopsLeft, hop_table, hops_left
from workbench.diagnose.proof import Errors, Proof

pytestmark = pytest.mark.long  # hops are simulated and fitted many times

RUNS = (
    Asked("hop", 17.0, 10.0),
    Asked("hop", 18.0, 10.0, "held_out"),
    Asked("clamped", 12.0, 2.0, "held_out"),
)
PULL_N = 0.2


@dataclass(frozen=True)
class Answered:
    """What of a diagnosis this page needs."""

    rig: HopperRig
    extended: HopperRig | None
    errors: Errors
    proof: Proof | None
    held_out: tuple[str, ...] = ("hop_18", "clamped_12")


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory) -> Answered:
    robot = truth(2, {"sole_adhesion": {"pull": PULL_N}}, off=0.0)
    rig = HopperRig(runs_of(robot, 2, RUNS), DOCUMENT, SHAPE)
    path = tmp_path_factory.mktemp("extended") / "sticky"
    extended = rig.extend(path, {}, {"sole_adhesion": {"pull": (PULL_N, 0.01)}}, "sticky")
    names = [run.name for run in rig.runs]
    errors = Errors({}, 0.3, "mm", {}, {name: {} for name in names})
    return Answered(rig, extended, errors, Proof(errors, errors))


def left_of(answered: Answered) -> list[HopsLeft]:
    return hops_left(cast("Diagnosis", answered))


@pytest.fixture(scope="module")
def held_out(answered: Answered) -> HopsLeft:
    """What of the hop held out each model leaves."""
    (left,) = left_of(answered)
    return left


def text_of(answered: Answered) -> str:
    html = hop_table(cast("Diagnosis", answered))
    return " ".join(unescape(re.sub(r"<[^>]+>", " ", html)).split())


def test_the_true_model_hops_as_the_robot_does_and_the_base_does_not(
    answered: Answered, held_out: HopsLeft
) -> None:
    left = held_out
    assert left.run == "hop_18"
    assert left.since == answered.rig.runs[1].times[-1] < 5
    off = {name: {test.name: test.apart for test in getattr(left, name)}
           for name in ("base", "extended")}  # fmt: skip
    assert max(map(abs, off["base"].values())) > 5
    assert max(map(abs, off["extended"].values())) < 4


def test_the_table_tells_each_property_of_the_held_out_hop_alone(
    answered: Answered, held_out: HopsLeft
) -> None:
    text = text_of(answered)
    assert "Run Of a hop Measured Base Off Extended Off" in text
    assert text.count("hop_18 from") == 4
    assert "hop_17" not in text
    assert "clamped_12" not in text
    stride = held_out.base[3]
    assert f"way forward [mm] {1000 * stride.measured:#.3g}" in text
    assert f"{stride.apart:+.1f}" in text


def test_without_an_extension_the_base_stands_alone(answered: Answered) -> None:
    bare = Answered(answered.rig, None, answered.errors, None)
    assert left_of(bare)[0].extended == ()
    assert "Measured Base Off" in text_of(bare)
    assert "Extended" not in text_of(bare)


def test_runs_without_hops_make_no_table(answered: Answered) -> None:
    clamped = Answered(answered.rig, None, answered.errors, None, ("clamped_12",))
    assert left_of(clamped) == []
    assert text_of(clamped) == ""
    assert answered.rig.events(2, {}) == ()
