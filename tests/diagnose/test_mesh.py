"""The mesh of the beam: the runs choose it before any cause is looked for, and once more after."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.diagnose.hidden import DOCUMENT, Asked, runs_of, truth
from tests.identify.robots import MODEL, SHAPE, released
from workbench.diagnose import Diagnosis, HopperRig, diagnose, mesh
from workbench.diagnose.candidates import Candidates, hopper_candidates
from workbench.diagnose.mesh import _Mesh
from workbench.diagnose.rules import RULES
from workbench.fit import FINER
from workbench.report import finer_beam
from workbench.schemas import load_model


def diagnosed(increments: int, out: Path) -> Diagnosis:
    runs = [released(MODEL, pull, 2.5, increments) for pull in (0.3, 0.8, 0.6)]
    runs[-1] = replace(runs[-1], role="held_out")
    return diagnose(HopperRig(runs, DOCUMENT, SHAPE), out, "april", threads=1)


@pytest.mark.budget(25)
def test_a_beam_that_is_smoother_than_the_model_s_is_no_cause(tmp_path: Path) -> None:
    found = diagnosed(64, tmp_path)
    print(found, found.extended)
    assert found.kind == "CLEAN"
    assert found.extended is not None
    assert load_model(str(found.extended.source), Path()).content.increments == FINER
    assert finer_beam(found) == (
        "a beam of 32 increments follows these runs better than one of 16; the new model has it"
    )


@pytest.mark.budget(25)
def test_the_model_s_own_beam_is_kept_where_the_runs_are_of_such_a_one(tmp_path: Path) -> None:
    found = diagnosed(16, tmp_path)
    assert found.extended is not None
    assert load_model(str(found.extended.source), Path()).content.increments == 16
    assert finer_beam(found) is None


@pytest.mark.budget(60)
def test_a_mesh_that_a_base_took_for_a_cause_is_given_back(tmp_path: Path) -> None:
    """Without friction in the hinges, runs of a beam of 16 increments prefer one of 32."""
    robot = truth(1, {"hinge_coulomb_friction": {"torque": 7e-4}})
    asked = (
        Asked("decay", 0.3, 2.5),
        Asked("decay", 0.8, 2.5),
        Asked("decay", 0.6, 2.5, "held_out"),
    )
    stages: list[str] = []
    rig = HopperRig(runs_of(robot, 1, asked), DOCUMENT, SHAPE)
    found = diagnose(rig, tmp_path, progress=lambda text: stages.append(str(text)), threads=1)
    print(found)
    assert (found.kind, [one.name for one in found.causes]) == ("NAMED", ["hinge_coulomb_friction"])
    (asked_at,) = [k for k, text in enumerate(stages) if "by the other mesh" in text]
    assert asked_at < next(k for k, text in enumerate(stages) if "promises beside" in text)
    observer = found.observer.parts["held foot"]
    missing = observer.fits.missing(observer.base)
    assert missing > 1  # so that play would be tried, did nothing else do
    assert ("root_play",) not in {one.names for one in observer.tried}
    assert found.extended is not None
    assert load_model(str(found.extended.source), Path()).content.increments == 16
    torque = found.causes[0].quantities["torque"]
    assert torque.low < 7e-4 < torque.high


class Moved:
    """Fits of a mesh by which a cause that is moved to it costs so much."""

    rules, candidates = RULES, Candidates.of(hopper_candidates({"clamped"}, ()))

    def __init__(self, cost: float) -> None:
        self.progress, self._cost = str, cost

    def at_once(self, one: Any) -> Any:
        return one

    def settled(self, one: Any) -> Any:
        return one

    def missing(self, one: Any) -> float:
        return 0.0

    def moved(self, one: Any) -> Any:
        return SimpleNamespace(names=one.names, cost=self._cost)

    def samples(self, names: Any = ()) -> int:
        return 10_000

    def repeats(self) -> float:
        return 1.0


def test_a_mesh_is_not_changed_for_a_cause_of_no_practical_size() -> None:
    """Beside the base of the mesh that is less likely, it seemed to gain more than it does."""
    leader: Any = SimpleNamespace(names=("tether",), cost=-30.0)
    least = RULES.practical(10_000)
    for cost, preferred in ((-least - 1, True), (-least + 1, False), (-29.0, False)):
        fits: Any = Moved(cost)
        bases: list[Any] = [SimpleNamespace(cost=0.0), SimpleNamespace(cost=70.0)]
        own, other = _Mesh(fits, bases[0]), _Mesh(fits, bases[1])
        assert other.prefers(own, leader) is preferred


def test_of_two_answers_by_two_meshes_the_likelier_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pair that one mesh shows was not found by the other, though it fits as well by that."""
    costs = {"own": -90.0, "other": -40.0}
    base: Any = SimpleNamespace(cost=0.0)
    meshes = [
        _Mesh(cast(Any, SimpleNamespace(of=key, rules=RULES, progress=str)), base) for key in costs
    ]
    single: Any = SimpleNamespace(names=("tether",), cost=-30.0)
    asked: list[tuple[str, ...]] = []

    def answered(fits: Any, listed: Any) -> Any:
        return SimpleNamespace(leader=SimpleNamespace(names=(fits.of,), cost=costs[fits.of]))

    def prefers(self: _Mesh, other: _Mesh, leader: Any) -> bool:
        asked.append(leader.names)
        return len(asked) > 1

    monkeypatch.setattr(mesh, "_meshes", lambda fits: list(meshes))
    monkeypatch.setattr(mesh, "shortlisted", lambda *given: SimpleNamespace(leader=single))
    monkeypatch.setattr(mesh, "observer_part", answered)
    monkeypatch.setattr(_Mesh, "prefers", prefers)
    found = mesh.by_mesh(cast(Any, SimpleNamespace(progress=str, rules=RULES)))
    assert asked == [("tether",), ("own",)]
    assert found.leader.names == ("own",)
