"""The next experiment by the observer: the run that tells is chosen, one that does not is not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from tests.diagnose.hidden import DOCUMENT, SHAPE, Asked, runs_of, truth
from workbench.diagnose import Diagnosis, HopperRig, ObserverPart
from workbench.diagnose.findings import Cause, EstimatedQuantity
from workbench.diagnose.fits import Fits
from workbench.diagnose.hypothesis import Hypothesis
from workbench.diagnose.observer_parts import ObserverParts
from workbench.diagnose.rules import RULES
from workbench.fit import Estimator, ParameterVector
from workbench.investigate import ProposedRun, investigate, propose
from workbench.investigate.drive_runs import propose_speed_among
from workbench.investigate.next_experiment import Proposal, minutes_of, propose_among
from workbench.investigate.predicted import Setting
from workbench.investigate.remaining import Remaining, remaining

NOISE = {"beam": 1e-5, "foot": 1e-3}
WEAK, STRONG = ProposedRun("decay", 0.005, 1.0, 2.0), ProposedRun("decay", 1.0, 1.0, 2.0)
CUBIC = ("hinge_cubic_stiffness", {"hinge_cubic_stiffness k3": -300.0})
DAMPING = ("hinge_quadratic_damping", {"hinge_quadratic_damping c": 0.02})


@pytest.fixture(scope="module")
def rig() -> HopperRig:
    """One short run of the robot of the thesis, as the model has it."""
    return HopperRig(runs_of(truth(1, {}, off=0.0), 1, [Asked("decay", 0.3, 1.2)]), DOCUMENT, SHAPE)


def left(
    rig: HopperRig, name: str, values: Mapping[str, float], weight: float = 0.5, known: float = 1e3
) -> Remaining:
    """Return a hypothesis of one candidate, or the base, whose numbers some runs know."""
    named = {one.name: one for one in rig.candidates}
    quantities = tuple(named[name].quantities.values()) if name else ()
    parameters = (*rig.base, *quantities)
    return Remaining(
        (name,) if name else (), parameters,
        {p.name: values.get(p.name, p.nominal) for p in parameters}, NOISE,
        {p.name: k for k, p in enumerate(parameters)}, known * np.eye(len(parameters)),
        0.0, np.zeros(4), np.zeros(0), weight,
    )  # fmt: skip


def proposed(
    rig: HopperRig, hypotheses: Sequence[Remaining], menu: Sequence[ProposedRun]
) -> Proposal | None:
    return propose_among(hypotheses, Setting(rig, RULES, samples=200, threads=1), menu)


def test_the_run_that_separates_is_chosen(rig: HopperRig) -> None:
    found = proposed(rig, [left(rig, *CUBIC), left(rig, *DAMPING)], [WEAK, STRONG])
    assert found is not None
    assert found.trials == (STRONG,)
    assert found.chance > 0.9
    assert found.minutes == minutes_of([STRONG, STRONG])  # one run names no cause
    assert {(one.truth, one.alternative) for one in found.separations} == {
        (CUBIC[0], DAMPING[0]),
        (DAMPING[0], CUBIC[0]),
    }


def test_a_menu_without_a_run_that_tells_gives_none(rig: HopperRig) -> None:
    hypotheses = [left(rig, *CUBIC), left(rig, *DAMPING)]
    assert proposed(rig, hypotheses, [WEAK]) is None
    assert proposed(rig, hypotheses, []) is None
    assert proposed(rig, hypotheses[:1], [STRONG]) is None


def test_what_a_rival_may_imitate_separates_nothing(rig: HopperRig) -> None:
    """A softer beam: the base follows where no run holds its stiffness, and not where one does."""
    softer = left(rig, "hinge_stiffness", {"hinge_stiffness": 9.3})
    held, free = (left(rig, "", {}, known=known) for known in (1e6, 1e-2))
    # the base costs more by what would not be rejected, or nothing remained to be told
    told = [proposed(rig, [softer, replace(one, cost=10.0)], [STRONG]) for one in (held, free)]
    assert told[0] is not None
    assert told[1] is not None
    apart = [
        next(s.distance for s in one.separations if s.alternative == "none of them")
        for one in told
        if one is not None
    ]
    assert apart[0] > 20
    assert apart[1] < 1


def test_what_the_runs_have_rejected_already_is_not_asked_again(rig: HopperRig) -> None:
    behind = replace(left(rig, *DAMPING, weight=0.0), cost=400.0, blocks=np.full(4, 100.0))
    assert proposed(rig, [left(rig, *CUBIC, weight=1.0), behind], [STRONG]) is None


def test_the_loop_ends_with_the_answer_of_this_diagnosis() -> None:
    for kind, names, words in (
        ("NAMED", ["root_play"], "one cause remains"),
        ("NAMED", ["root_play", "speed_scale"], "one pair of causes remains"),
        (
            "SET",
            ["root_play", "air_drag"],
            "no run that this bench can make distinguishes the causes that remain",
        ),
        ("CLEAN", [], "nothing remains to be found"),
    ):
        found = object.__new__(Diagnosis)
        vars(found).update(kind=kind, causes=tuple(cause(one, "share", 0.1, 0.01) for one in names))
        turns = list(investigate(None, lambda job: None, lambda n, one=found: (one, None), 30.0))
        assert [one.ended for one in turns] == [words]


def test_minutes_hold_runs_handling_and_the_foot_once() -> None:
    assert minutes_of([ProposedRun("clamped", 13.0, 8.0, 2.0)]) == (10 + 60 + 180) / 60
    assert minutes_of([ProposedRun("hop", 17.0, 8.0, 2.0)] * 2) == 2 * (10 + 90) / 60


def cause(name: str, quantity: str, value: float, error: float) -> Cause:
    return Cause(name, {quantity: EstimatedQuantity(value, value, value, "1", error)}, "")


def test_a_scale_and_an_offset_of_the_speed_part_far_from_the_speeds_that_were_run() -> None:
    scale = cause("speed_scale", "share", 0.01, 1e-4)
    offset = cause("speed_offset", "offset", 0.13, 1e-3)  # the same at 13 rad/s
    menu = [ProposedRun("clamped", speed, 8.0, 2.0) for speed in (12.9, 13.0, 13.1, 20.0)]
    found = propose_speed_among([scale, offset], [0.5, 0.5], [*menu, STRONG], RULES)
    assert found is not None
    assert found.trials == (menu[-1],)
    assert found.chance > 0.5
    assert propose_speed_among([scale, offset], [0.5, 0.5], menu[:3], RULES) is None
    ripple = cause("speed_ripple", "cos_1", 0.1, 0.01)
    assert propose_speed_among([scale, ripple], [0.5, 0.5], menu, RULES) is None


def clean(rig: HopperRig) -> Diagnosis:
    """Return as much of a clean diagnosis of a rig's runs as a proposal asks for."""
    fits = Fits(rig, threads=1)
    system = rig.system(fits.train, rig.base)
    vector = ParameterVector(system.parameters)
    x = np.zeros(len(vector))
    estimator = Estimator.of(system, vector, NOISE, threads=1)
    base = Hypothesis((), estimator, x, (np.zeros(4),), 0.0, estimator.jacobian(x))
    part: Any = SimpleNamespace(kind="CLEAN")
    observer = ObserverPart(part, (), base, base, (), tuple(fits.promises(base)), (), fits)
    return cast(Diagnosis, SimpleNamespace(
        rig=rig, kind="CLEAN", rules=RULES, parts={"held foot": part}, causes=(),
        observer=ObserverParts({"held foot": observer}, fits),
    ))  # fmt: skip


def test_a_clean_answer_leaves_what_its_runs_could_not_show(rig: HopperRig) -> None:
    found = clean(rig)
    told = remaining(found, rig.with_modes({"clamped"}))
    names = {one.name for one in told}
    assert told[0].names == ()
    assert "air_drag" in names
    assert not {"root_play", "local_stiffness_loss"} & names  # of their tolerance they would show
    assert not told[0].hidden
    assert all(one.hidden for one in told[1:])
    fault = cast(Any, SimpleNamespace(**vars(found) | {"kind": "DATA_FAULT"}))
    assert propose(fault, [STRONG]) is None
