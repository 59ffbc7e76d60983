"""The fit of the beam: known robots in, their parameters and honest intervals out."""

from __future__ import annotations

from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from tests.identify.robots import MODEL, SHAPE, changed, driven, released
from workbench.errors import InputError
from workbench.identify import Identification, MeasuredRun, identify, write_model
from workbench.identify.determinacy import Combination
from workbench.identify.drive import lagged_angle, lagged_command
from workbench.identify.intervals import bootstrap
from workbench.identify.mesh import FINEST
from workbench.identify.problem import Problem
from workbench.identify.solve import FINER, fit_runs
from workbench.progress import Stage
from workbench.protocol import ModelFile, load, load_model
from workbench.sim import make_robot

STIFF = ("hinge_stiffness", "root_stiffness")
TRUE = {"hinge_stiffness": 11.6, "root_stiffness": 9.4}
ROBOT = make_robot(MODEL.values(), SHAPE)
UNBALANCE = {"rotor_mass": 1.03 * 0.0334, "rotor_radius": 1.05 * 0.035}
COARSE = 17  # steps a sample that are too few for a beam twice as stiff


@pytest.fixture(scope="module")
def found() -> Identification:
    true = changed(**TRUE)
    runs = [driven(true, "clamped", 13.0, 2.0), released(true, 0.4, 2.0)]
    return identify(runs, MODEL, SHAPE, STIFF)


@pytest.mark.budget(15)  # the fit that the module shares
def test_stiffness_20_percent_off_is_found(found: Identification) -> None:
    assert found.increments == 16
    assert found.misfit == pytest.approx(1.0, abs=0.1)
    assert found.not_determined == ()
    assert found.warnings == ()
    for name, truth in TRUE.items():
        estimate = found.estimates[name]
        assert estimate.value == pytest.approx(truth, rel=0.01)
        assert estimate.low < estimate.value < estimate.high
        assert abs(estimate.value - truth) < 3 * estimate.half_width
        assert estimate.stated == MODEL.values()[name]


@pytest.mark.long
def test_a_fit_of_a_model_that_lacks_something_says_so() -> None:
    true = changed(**TRUE, top_mass=0.091)
    runs = [driven(true, "clamped", 13.0, 2.0), released(true, 0.4, 2.0)]
    wrong = identify(runs, MODEL, SHAPE, STIFF)
    print(wrong.misfit, wrong.estimates, wrong.warnings)
    (warning,) = wrong.warnings
    assert warning.startswith("the model lacks something that the runs show: it misses them by 1.")
    assert "values and intervals do not know of it. `workbench diagnose`" in warning


def test_the_new_model_holds_what_was_found_and_where_from(
    found: Identification, tmp_path: Path
) -> None:
    stated = load_model("thesis", tmp_path)
    names = [run.name for run in found.runs]
    path = tmp_path / "models" / "mine.yaml"
    write_model(path, stated, found.values, found.estimates, names, date(2026, 3, 12), 32)
    read = load(path, ModelFile).content
    assert (read.name, read.increments) == ("mine", 32)
    for name, estimate in found.estimates.items():
        entry = getattr(read.parameters, name)
        assert entry.value == pytest.approx(estimate.value, rel=1e-5)
        assert entry.tolerance == pytest.approx(estimate.half_width, rel=0.05)
        assert entry.source.startswith("identified 2026-03-12 from 2 run(s) (clamped_13, decay_0.4")
        assert "; was " in entry.source
    assert read.parameters.top_mass == stated.content.parameters.top_mass
    with pytest.raises(InputError, match=r"mine.yaml: exists; a model is never changed"):
        write_model(path, stated, found.values, found.estimates, names, date(2026, 3, 12))


def test_the_jacobian_is_the_slope_of_the_residuals() -> None:
    problem = Problem(
        [driven(MODEL, "clamped", 13.0, 0.6), released(MODEL, 0.4, 0.6)], ROBOT, STIFF
    )
    x = problem.start + 0.02
    slopes = problem.jacobian(x)
    step = 1e-4
    for i, unknown in enumerate(problem.unknowns):
        ahead, behind = x.copy(), x.copy()
        ahead[i] += step
        behind[i] -= step
        slope = (problem.residuals(ahead) - problem.residuals(behind)) / (2 * step)
        apart = np.linalg.norm(slopes[:, i] - slope) / np.linalg.norm(slope)
        assert apart < 0.02, unknown


def test_only_what_is_too_stiff_is_simulated_in_shorter_steps() -> None:
    """At the edge a step of the difference is over it, and base and step must be made alike."""
    runs = [released(changed(**TRUE), 0.4, 0.5)]
    stiff, soft = 1.0, 0.0
    while stiff - soft > 5e-5:
        x = (stiff + soft) / 2
        problem = coarse(runs)
        problem.residuals(np.append(x, problem.start[1:]))
        assert problem._known is not None
        stiff, soft = (x, soft) if problem._known.steps > COARSE else (stiff, x)
    problem, finer = coarse(runs), coarse(runs, 2 * COARSE)
    edge = np.append(soft, problem.start[1:])
    problem.residuals(edge)
    assert problem._known is not None
    assert problem._known.steps == COARSE
    np.testing.assert_allclose(problem.jacobian(edge)[:, 0], finer.jacobian(edge)[:, 0], rtol=1e-6)
    problem.residuals(problem.start)
    assert problem._known.steps == COARSE


def coarse(runs: list[MeasuredRun], steps: int = 0) -> Problem:
    return Problem(runs, replace(ROBOT, steps_per_sample=steps or COARSE), ["hinge_stiffness"])


@pytest.mark.long
@pytest.mark.parametrize("pulls", [(0.8,), pytest.param((0.3, 0.8), marks=pytest.mark.long)])
def test_a_beam_of_more_increments_is_taken_where_16_cannot_follow(
    pulls: tuple[float, ...],
) -> None:
    runs = [released(MODEL, pull, 2.0, increments=40) for pull in pulls]
    told: list[str] = []
    fit = fit_runs(runs, ROBOT, {"hinge_stiffness": 0.1}, told.append)
    shares = [stage.share for stage in told if isinstance(stage, Stage)]
    known = [share for share in shares if share is not None]
    assert len(known) >= 3
    assert known == sorted(known)
    assert known[0] == 0.0
    assert 0.3 < known[-1] < 1.0
    assert FINER <= fit.solution.problem.robot.increments <= FINEST
    assert fit.solution.misfit < 1.2


@pytest.mark.long
def test_not_knowing_the_mesh_widens_the_interval_over_the_truth() -> None:
    """The strip has 40 increments; with the mesh held, an interval is the noise's alone."""
    runs = [released(MODEL, pull, 4.0, increments=40) for pull in (0.3, 0.5, 0.8)]
    found = identify(runs, MODEL, SHAPE, ["hinge_stiffness"])
    told = found.estimates["hinge_stiffness"]
    low, high = told.low / told.stated, told.high / told.stated
    held = np.percentile(np.exp(bootstrap(found.solution)), [5, 95])
    print(found.increments, (low, high), held)
    assert low < 1.0 < high
    assert high - low > 1.5 * float(np.ptp(held))
    assert high - low < 0.01


@pytest.mark.parametrize(
    ("exponents", "words"),
    [
        ({"a": 1.0, "b": -1.0}, "a * b: only this product is determined"),
        ({"a": 1.0, "b": 0.97}, "a / b: only this ratio is determined"),
        ({"a": 1.0}, "a: the data do not depend on it"),
        ({"a": 1.0, "b": -0.5}, "a common change of a^1, b^-0.5 is not determined"),
    ],
)
def test_a_combination_is_told_in_words(exponents: dict[str, float], words: str) -> None:
    assert str(Combination(exponents, 3.0)) == words


@pytest.mark.long
def test_parameters_that_only_act_as_a_product_are_told_as_such() -> None:
    # A slow rotor moves T by its unbalance alone, mass times radius.
    found, stated = unbalanced(2.0, 3.0)
    (one,) = found.not_determined
    assert str(one) == "rotor_mass * rotor_radius: only this product is determined"
    assert str(one) in found.warnings
    assert found.estimates == {}
    assert list(found.values) == ["rotor_radius"]  # it carries the product, at the stated mass
    product = stated.values()["rotor_mass"] * found.values["rotor_radius"]
    assert product == pytest.approx(UNBALANCE["rotor_mass"] * UNBALANCE["rotor_radius"], rel=0.02)


@pytest.mark.long
def test_parameters_of_a_product_are_both_told_where_one_acts_by_itself() -> None:
    # At 13 rad/s the rotor's mass also detunes the beam.
    fast, _ = unbalanced(13.0, 2.0)
    assert fast.not_determined == ()
    found = {name: estimate.value for name, estimate in fast.estimates.items()}
    assert found == pytest.approx(UNBALANCE, rel=0.01)


def unbalanced(omega: float, seconds: float) -> tuple[Identification, ModelFile]:
    """Fit mass and radius of a rotor whose arm weighs next to nothing; return the model as well."""
    light = {"rotor_arm_mass": 1e-4}
    run = driven(changed(**light, **UNBALANCE), "clamped", omega, seconds)
    return identify([run], changed(**light), SHAPE, tuple(UNBALANCE)), changed(**light)


def test_a_fit_without_its_runs_or_names_says_what_to_do() -> None:
    hop = driven(MODEL, "hop", 17.0, 0.5)
    with pytest.raises(InputError, match=r"given are hop\. protocols/clamped-sweep\.yaml and"):
        identify([hop], MODEL, SHAPE)
    clamped = driven(MODEL, "clamped", 13.0, 0.5)
    with pytest.raises(InputError, match="'hinge_stifness' is unknown; did you mean"):
        identify([clamped], MODEL, SHAPE, ["hinge_stifness"])
    with pytest.raises(InputError, match="no parameter is named; --fit takes names"):
        identify([clamped], MODEL, SHAPE, [])
    known = MODEL.parameters.top_mass.model_copy(update={"tolerance": 0.0})
    exact = MODEL.parameters.model_copy(update={"top_mass": known})
    model = MODEL.model_copy(update={"parameters": exact})
    with pytest.raises(InputError, match="top_mass has tolerance 0 in model 'thesis'"):
        identify([clamped], model, SHAPE, ["top_mass"])


def test_a_lagging_motor_turns_as_its_equation_says() -> None:
    times = np.linspace(0, 3, 30001)
    steps = ((0.2, 5.0), (0.7, 17.0), (2.0, 0.0))
    speed, turned = 0.0, [0.0]
    for at in times[1:]:
        wanted = 0.98 * [w for t, w in ((-1.0, 0.0), *steps) if t <= at][-1]
        speed += (wanted - speed) * 1e-4 / 0.06
        turned.append(turned[-1] + speed * 1e-4)
    angle = lagged_angle(times, steps, 0.06, 0.98)
    np.testing.assert_allclose(angle, turned, atol=4e-3)  # two steps of the sum at full speed
    coarse = times[::250]
    command = lagged_command(coarse, steps, 0.06, 0.98)
    reached = np.concatenate([[0.0], np.cumsum(command[:-1] * np.diff(coarse))])
    np.testing.assert_allclose(reached, angle[::250], atol=1e-9)
