from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from workbench.design import (
    ALGORITHMS,
    BOUNDS,
    GOALS,
    DistanceDraws,
    Objective,
    Settings,
    Study,
    appraise,
    found_by,
    shape_text,
    write_history,
)
from workbench.errors import InputError, WorkbenchError
from workbench.optimize import Evaluation, Trial
from workbench.report.design.page import write_report
from workbench.schemas import ShapeFile, load_model, load_shape, parse
from workbench.sim import Fanout

DAY = date(2026, 11, 21)
SMALL = Settings(duration=1.0, algorithm="ga", evaluations=24, seed=3)
Begin = Callable[[Settings], Study]


@pytest.fixture
def begin(tmp_path: Path) -> Begin:
    def begin(settings: Settings) -> Study:
        model, start = load_model("thesis", Path()), load_shape("thesis-initial", Path())
        return Study.begin(tmp_path / "search", settings, model, start)

    return begin


def test_a_search_gets_better_and_goes_on_the_same(begin: Begin, tmp_path: Path) -> None:
    study = begin(SMALL)
    with Fanout() as fanout:
        whole = study.run(fanout)
        half = begin_at(tmp_path / "half", replace(SMALL, evaluations=12))
        half.run(fanout)
        longer = Study.resume(tmp_path / "half" / "search.json")
        again = replace(longer, settings=SMALL).run(fanout)
    assert whole.asked == 24
    assert whole.best.evaluation.fitness < whole.trials[0].evaluation.fitness
    assert whole.trials[0].candidate.tobytes() == study.problem.space.start.tobytes()
    assert [bits(t) for t in again.trials] == [bits(t) for t in whole.trials]


def bits(trial: Trial) -> tuple[bytes, Evaluation]:
    return trial.candidate.tobytes(), trial.evaluation


def begin_at(folder: Path, settings: Settings) -> Study:
    model, start = load_model("thesis", Path()), load_shape("thesis-initial", Path())
    return Study.begin(folder, settings, model, start)


def test_going_on_needs_the_folder_alone(begin: Begin) -> None:
    study = begin(replace(SMALL, vary=("omega=15:21",), goals=("stability",)))
    again = Study.resume(study.folder)
    assert again.settings == study.settings
    assert again.problem.identity == study.problem.identity
    assert again.problem.space.describe() == study.problem.space.describe()


def test_a_folder_holds_one_search(begin: Begin) -> None:
    begin(SMALL)
    with pytest.raises(InputError, match=r"holds a search already; go on with --resume .*search"):
        begin(SMALL)


def test_another_problem_s_checkpoint_is_refused_by_what_differs(
    begin: Begin, tmp_path: Path
) -> None:
    study = begin(replace(SMALL, evaluations=12))
    with Fanout() as fanout:
        study.run(fanout)
        other = begin_at(tmp_path / "other", replace(SMALL, omega=18.0))
        (tmp_path / "other" / "search.json").write_bytes(study.checkpoint.read_bytes())
        with pytest.raises(
            InputError, match=r"problem is .*at 17 rad/s.* there and .*at 18 rad/s.* here"
        ):
            other.run(fanout)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("{", "settings of no search"),
        ('{"schema": "workbench/shape-1"}', "its schema is not workbench/optimize-1"),
        ('{"schema": "workbench/optimize-1", "omega": 17}', "keys .* are missing or unknown"),
    ],
)
def test_torn_or_foreign_settings_are_refused(begin: Begin, text: str, why: str) -> None:
    study = begin(SMALL)
    (study.folder / "settings.json").write_text(text)
    with pytest.raises(InputError, match=why):
        Study.resume(study.folder)


def test_edited_settings_are_refused(begin: Begin) -> None:
    study = begin(SMALL)
    path = study.folder / "settings.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"omega": "fast"}))
    with pytest.raises(InputError, match=r"settings of no search, omega: Input should be a valid"):
        Study.resume(study.folder)


def test_there_is_nothing_to_go_on_with_elsewhere(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no search to go on with.*no settings\.json"):
        Study.resume(tmp_path)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"algorithm": "gaa"}, r"no algorithm named 'gaa'; did you mean 'ga'"),
        ({"bounds": "Thesis E"}, r"no bounds named 'Thesis E'"),
        ({"mutation": "gauss"}, r"no mutation named 'gauss'; did you mean 'gaussian'"),
        ({"goals": ("distance", "cost")}, r"ga takes 1 goal\(s\), 2 \(distance, cost\) are given"),
        ({"algorithm": "pareto"}, r"pareto takes 2 goal\(s\), 1 \(distance\)"),
        ({"algorithm": "pareto", "goals": ("cost", "cost")}, r"pareto takes 2 goal"),
    ],
)
def test_settings_that_fit_nothing_are_refused(change: dict[str, str], why: str) -> None:
    with pytest.raises(InputError, match=why):
        replace(SMALL, **change)  # type: ignore[arg-type]


def test_nothing_is_written_for_a_search_that_cannot_be(begin: Begin, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"top_mass: lower 0\.2 and upper 0\.1 leave nothing"):
        begin(replace(SMALL, vary=("top_mass=0.2:0.1",)))
    assert not (tmp_path / "search").exists()


def test_the_gaussian_mutation_shrinks_until_the_last_generation(begin: Begin) -> None:
    objective = Objective(begin(SMALL).problem, Fanout())
    made = ALGORITHMS["ga"](objective, replace(SMALL, mutation="gaussian", evaluations=120))
    assert made.options["generations"] == 10
    assert made.options["mutation_fcn"] == "mutationgaussian"


def test_a_found_shape_is_read_back_bit_for_bit_and_hops_as_far(begin: Begin) -> None:
    study = begin(replace(SMALL, evaluations=12))
    with Fanout() as fanout:
        history = study.run(fanout)
    (found,) = found_by(study, history, DAY)
    shape = load_shape(str(found.shape), Path()).content
    assert shape.angles == tuple(history.best.candidate.tolist())
    (born,) = [k for k, g in enumerate(history.generations, 1) if history.best in g.trials][:1]
    assert found.name == f"g{born}-best"
    assert shape.name == f"{study.folder.name}-{found.name}"
    assert shape.length == study.start.content.length
    assert shape.state == "unloaded"
    assert re.match(
        r"designed 2026-11-21 by ga, seed 3, 12 evaluations: distance in 1 s at "
        r"17 rad/s, [0-9a-f]{12}; distance_m .*begun at thesis-initial, model thesis; "
        r"candidate [0-9a-f]{8}$",
        shape.source,
    )
    own = replace(study.problem, shape=shape)
    again = appraise(own, own.space.start)
    assert again.values["distance"] == found.values["distance_m"]
    assert found_by(study, history, DAY) == [found]  # written again is the same file


def test_a_strip_keeps_its_sizes() -> None:
    start = load_shape("thesis-initial", Path()).content
    start = start.model_copy(update={"thickness": 0.002, "width": 0.0165, "state": "loaded"})
    text = shape_text(start, "new", np.array(start.angles), 'bent "by hand" \\ today')
    again = parse(Path("new.yaml"), text, ShapeFile).content
    assert again == start.model_copy(update={"name": "new", "source": 'bent "by hand" \\ today'})


def test_a_varied_number_is_written_as_a_model(begin: Begin) -> None:
    study = begin(replace(SMALL, evaluations=12, vary=("top_mass=0.05:0.12", "omega=16:19")))
    with Fanout() as fanout:
        history = study.run(fanout)
    (found,) = found_by(study, history, DAY)
    assert found.model is not None
    values = load_model(str(found.model), Path()).content.values()
    assert values["top_mass"] == history.best.candidate[16]
    assert found.omega == history.best.candidate[17]
    stated = load_model("thesis", Path()).content.values()
    assert {n for n in stated if stated[n] != values[n]} <= {"top_mass"}


def test_the_report_of_a_search_needs_nothing_beside_it(begin: Begin) -> None:
    study = begin(replace(SMALL, evaluations=12))
    with Fanout() as fanout:
        history = study.run(fanout)
    found = found_by(study, history, DAY)
    page = study.folder / "report.html"
    write_report(page, study, history, found, DistanceDraws((0.31, 0.29), 1), {"workbench": "0"})
    text = page.read_text(encoding="utf-8")
    assert text.count("<svg") == 4
    assert f"goes {1000 * found[0].values['distance_m']:.0f} mm" in text
    assert f"workbench optimize --resume {study.folder} --evaluations 24" in text
    assert "Longitudinal frequency, clamped" in text
    assert "design goes 291 to 309 mm, median 300 mm (3 draws, 1 failed)" in text
    assert found[0].shape.name in text
    assert not re.search(r'(src|href)="(?!#)', text)


def test_the_history_is_a_table_of_every_candidate(begin: Begin) -> None:
    study = begin(SMALL)
    with Fanout() as fanout:
        history = study.run(fanout)
    write_history(study.folder / "history.csv", study, history)
    rows = (study.folder / "history.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 25
    head = rows[0].split(",")
    assert head[:2] == ["generation", "alpha_0"]
    assert [goal.column for goal in GOALS.values()] == head[-5:-1]


def test_two_goals_give_a_front_of_shapes(begin: Begin) -> None:
    pytest.importorskip("pymoo", reason="needs the extra `pareto`")
    study = begin(
        replace(SMALL, algorithm="pareto", goals=("distance", "stability"), evaluations=24)
    )
    with Fanout() as fanout:
        history = study.run(fanout)
    found = found_by(study, history, DAY)
    assert len({one.shape for one in found}) == len(found) >= 2
    assert all(re.fullmatch(r"shape-g\d+-\d+\.yaml", one.shape.name) for one in found)
    fitness = np.array([one.trial.evaluation.fitness for one in found])
    assert np.all(np.diff(fitness[:, 0]) > 0)
    assert np.all(np.diff(fitness[:, 1]) < 0)
    page = study.folder / "report.html"
    write_report(page, study, history, found, DistanceDraws((), 16), {})
    assert page.read_text(encoding="utf-8").count("<svg") == 5


def test_a_search_where_all_fails_ends_and_says_why(begin: Begin) -> None:
    study = begin(replace(SMALL, evaluations=12, least_radius=1.0))
    with Fanout() as fanout:
        history = study.run(fanout)
    assert all("cannot be bent" in text for text in history.generations[0].failures)
    assert len(history.generations[0].failures) == 12
    with pytest.raises(WorkbenchError, match=r"none of 12 candidates hopped.* most often: this "):
        found_by(study, history, DAY)


def test_a_lost_cluster_ends_the_search_with_its_checkpoint_whole(begin: Begin) -> None:
    study = begin(SMALL)

    class Lost(Fanout):
        calls = 0

        def attempt(self, *given: object, **named: object) -> list:  # type: ignore[override]
            Lost.calls += 1
            if Lost.calls == 2:
                raise WorkbenchError("the scheduler has not answered")
            return super().attempt(*given, **named)  # type: ignore[arg-type]

    with Lost() as fanout, pytest.raises(WorkbenchError, match="has not answered"):
        study.run(fanout)
    with Fanout() as fanout:
        assert study.run(fanout).asked == 24


def test_both_bounds_are_named_in_the_settings() -> None:
    assert set(BOUNDS) == {"thesis", "appendix-e"}
    assert SMALL.bounds == "thesis"
