"""Windows are asked where nothing is named from rest, and only add a name that is proved."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from workbench.diagnose import diagnosis
from workbench.diagnose.answer import Answer
from workbench.diagnose.search import Search


@dataclass
class Script:
    """What the second look finds."""

    kind: str = "NAMED"
    shown: bool = True
    windows: bool = True
    asked: list[Any] = field(default_factory=list)

    @property
    def refits(self) -> Any:
        def in_windows(z: Any) -> Any:
            self.asked.append(z)
            return "windows" if self.windows else None

        base = SimpleNamespace(fit=SimpleNamespace(z=np.arange(3.0)))
        return SimpleNamespace(problem=SimpleNamespace(in_windows=in_windows), base=base)


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Script:
    told = Script()

    def refit(problem: Any, tell: Any, seed: int, before: Any) -> Any:
        told.asked += [problem, seed, before]
        return "again"

    def judge(refits: Any, held: Any, tell: Any) -> Any:
        best: Any = None
        return "errors", Answer(told.kind, ("foot_cg",), best, {}, (), "it is clear")  # type: ignore[arg-type]

    monkeypatch.setattr(diagnosis, "refit_all", refit)
    monkeypatch.setattr(diagnosis, "_judged", judge)
    monkeypatch.setattr(diagnosis, "_shown", lambda *asked: told.shown)
    return told


def look(script: Script) -> Any:
    stages: list[str] = []
    before = script.refits
    found = diagnosis._in_windows(before, (1,), stages.append, 7)  # pyright: ignore[reportPrivateUsage]
    return found, stages, before


def test_a_name_that_is_proved_counts_and_the_reason_tells_where_it_is_from(script: Script) -> None:
    found, stages, before = look(script)
    refits, errors, answer = found
    assert (refits, errors) == ("again", "errors")
    assert answer.kind == "NAMED"
    assert answer.reason == (
        "it is clear; hops told it in short windows that begin while the foot stands, not from rest"
    )
    assert stages == ["compare hops in windows as well"]
    np.testing.assert_array_equal(script.asked[0], np.arange(3.0))
    assert script.asked[1:3] == ["windows", 7]
    assert script.asked[3] is before


@pytest.mark.parametrize("kind", ["SET", "NONE", "CLEAN"])
def test_what_windows_do_not_name_they_do_not_change(script: Script, kind: str) -> None:
    script.kind = kind
    assert look(script)[0] is None


def test_a_name_that_does_not_show_in_runs_held_out_does_not_count(script: Script) -> None:
    script.shown = False
    assert look(script)[0] is None


def test_without_windows_nothing_is_fitted_again(script: Script) -> None:
    script.windows = False
    found, stages, _ = look(script)
    assert found is None
    assert not stages
    assert len(script.asked) == 1


def test_what_was_promising_from_rest_is_fitted_in_windows_from_its_place() -> None:
    search: Any = object.__new__(Search)
    said: list[str] = []
    fitted: list[Any] = []
    search.best, search.tell = {("tether",): "fitted here"}, said.append
    search._fit_anew = lambda causes, z: fitted.append((causes, z))
    others: Any = [
        SimpleNamespace(causes=(name,), fit=SimpleNamespace(z=k))
        for k, name in enumerate(("tether", "foot_cg"))
    ]
    search.take_up(others)
    assert fitted == [(("foot_cg",), 1)]
    assert said == ["take up foot_cg (1 of 1)"]
