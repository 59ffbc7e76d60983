"""Identifications over time, as the model files of a folder hold them."""

from __future__ import annotations

from datetime import date, timedelta
from pathlib import Path

from workbench.identify import ParameterEstimate, write_model
from workbench.panel.runs import trend_page
from workbench.schemas import identifications, load_model

STIFFNESS = [9.31, 9.30, 9.32, 9.31, 9.30, 9.33, 8.61]
FIRST = date(2026, 3, 2)


def estimate(value: float, unit: str) -> ParameterEstimate:
    return ParameterEstimate(value, 0.99 * value, 1.01 * value, unit, 9.5, 0.2)


def write_weeks(models: Path) -> None:
    """An identification a week, each from the model before; the damping is fitted twice."""
    before = load_model("thesis", models)
    for week, value in enumerate(STIFFNESS):
        found = {"hinge_stiffness": estimate(value, "N m/rad")}
        if week in (0, 3):
            found["hinge_damping"] = estimate(0.0036 + 1e-5 * week, "N m s/rad")
        values = {name: one.value for name, one in found.items()} | {"root_damping": 0.02}
        day = FIRST + timedelta(weeks=week)
        path = models / f"thesis-{day}.yaml"
        before = write_model(path, before, values, found, ["one", "two"], day)


def test_each_identification_gives_what_it_determined_itself(tmp_path: Path) -> None:
    write_weeks(tmp_path)
    (tmp_path / "other.yaml").write_text("schema: workbench/shape-1\n")
    (tmp_path / "stated.yaml").write_text(load_model("thesis", tmp_path).text)
    found = identifications(tmp_path)
    assert [one.day for one in found] == [FIRST + timedelta(weeks=k) for k in range(7)]
    assert found[-1].model == "thesis-2026-04-13"
    assert [one.values["hinge_stiffness"] for one in found] == STIFFNESS
    assert ["hinge_damping" in one.values for one in found] == [k in (0, 3) for k in range(7)]
    assert not any("root_damping" in one.values for one in found), "not determined"
    assert identifications(tmp_path / "none") == []


def test_the_trend_page_charts_identified_parameters(tmp_path: Path) -> None:
    write_weeks(tmp_path / "models")
    text = trend_page(tmp_path / "runs", models=tmp_path / "models")
    assert "7 identifications in models, 2026-03-02 to 2026-04-13" in text
    assert (
        "Hinge stiffness [N m/rad]: OUT OF CONTROL in 1 of 7 identifications, first "
        "thesis-2026-04-13; mean 9.312"
    ) in text
    assert "Hinge damping [N m s/rad]: fewer than five identifications" in text
    assert "Root damping" not in text
    assert "Identified parameters" not in trend_page(tmp_path / "runs", models=tmp_path)


def test_an_interval_of_an_earlier_model_is_no_interval_of_a_later_one(tmp_path: Path) -> None:
    before = load_model("thesis", tmp_path)
    found = {"top_mass": estimate(0.09, "kg")}
    first = write_model(tmp_path / "a.yaml", before, {"top_mass": 0.09}, found, ["r"], FIRST)
    write_model(tmp_path / "b.yaml", first, {"top_mass": 0.08}, {}, ["r"], FIRST)
    assert [one.model for one in identifications(tmp_path)] == ["a"], "b has it in combination only"
