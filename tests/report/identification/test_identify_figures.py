"""The figures hold the data they say, and the reports say what was found."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tests.bundles import carried_out
from tests.identify.linear_robot import MODES, answer, driven, released
from workbench.errors import InputError
from workbench.fit import Estimator, Hopper, MeasuredRun, ParameterVector, settled
from workbench.identify import (
    Identification,
    Pair,
    ParameterEstimate,
    damping,
    fitted_pairs,
    frequency_surface,
    resonances,
    simulated_pair,
)
from workbench.motion import FOOT, TOP
from workbench.report import ReportPart, palette, write_identification, write_resonances
from workbench.report.identification.figures import (
    damping_figure,
    figure_4_1,
    figure_4_2,
    figure_4_3,
    figure_4_4,
    figure_4_5,
    sweep_figure,
)
from workbench.schemas import load_model, load_shape
from workbench.sim import Condition, Robot, linear_modes, make_robot, sample_times, simulate
from workbench.timeseries import TimeSeries

NOISE_M = 2e-4
STIFFNESS = ParameterEstimate(9.3, 9.28, 9.32, "N m/rad", 9.5, 0.5)
ROOT = ParameterEstimate(12.1, 12.0, 12.2, "N m/rad", 12.0, 1.0)
MASS = ParameterEstimate(0.0891, 0.0887, 0.0895, "kg", 0.088, 0.002)


@pytest.fixture(scope="module")
def robot() -> Robot:
    shape = load_shape("thesis-initial", Path()).content
    return make_robot(load_model("thesis", Path()).content.values(), shape)


@pytest.fixture(scope="module")
def ring(robot: Robot) -> MeasuredRun:
    """The thesis' robot, pulled by 0.2 N and let go, seen with noise."""
    condition = Condition("decay", np.zeros(len(sample_times(3.0))), rest=0.6, pull=0.2)
    motion = simulate(robot, condition).motion
    noise = np.random.default_rng(0).normal(0, NOISE_M, motion.values.shape)
    names = motion.names
    seen = TimeSeries(motion.times, motion.values + noise, names, motion.valid)
    return MeasuredRun("ring", "decay", seen, pull=0.2)


@pytest.fixture(scope="module")
def fitted(robot: Robot, ring: MeasuredRun) -> Identification:
    """What a fit of nothing but the ring's own start comes to."""
    system = Hopper(robot, [ring])
    vector = ParameterVector(system.parameters)
    estimator = Estimator.of(system, vector, {"beam": 1e-5, "foot": 1e-5})
    return Identification(
        estimates={"hinge_stiffness": STIFFNESS, "root_stiffness": ROOT},
        within_tolerance={"top_mass": MASS}, values={},
        not_determined=(), misfits={"ring": 1.02}, warnings=("k is far from <stated>",),
        runs=(ring,), robot=robot, fit=settled(estimator, np.zeros(len(vector))),
    )  # fmt: skip


def drawn(figure: Figure, axes: int, line: int = 0) -> NDArray[np.float64]:
    """What a line of a figure shows, (n, 2)."""
    return np.asarray(figure.axes[axes].lines[line].get_xydata(), dtype=float)


def test_figure_4_1_shows_z_against_x_and_over_time() -> None:
    runs = [driven(8.0), driven(14.0)]
    figure = figure_4_1(runs)
    assert [ax.get_title(loc="left") for ax in figure.axes[::2]] == ["8.0 rad/s", "14.0 rad/s"]
    motion = runs[1].motion
    path, time = drawn(figure, 2), drawn(figure, 3)
    assert path[:, 0] == pytest.approx(motion[TOP[0]])
    assert path[:, 1] == pytest.approx(motion[TOP[2]])
    assert time[:, 0] == pytest.approx(motion.times)
    assert figure.axes[2].get_xlabel() == "x of T [m]"
    with pytest.raises(InputError, match=r"figure 4\.1 needs a clamped run"):
        figure_4_1([])


def test_figure_4_2_shows_spectra_in_millimetres_and_names_their_lines() -> None:
    found = resonances([released()]).spectra
    figure = figure_4_2(found)
    assert drawn(figure, 0, 0)[:, 1] == pytest.approx(1000 * found[0].amplitude[:, 0])
    assert drawn(figure, 0, 1)[:, 1] == pytest.approx(1000 * found[0].amplitude[:, 1])
    named = [text.get_text().split("\n")[0] for text in figure.axes[0].texts]
    assert named == ["torsional", "longitudinal"]
    assert figure.axes[0].get_title(loc="left") == "after the release"


def test_figure_4_3_shows_the_longitudinal_mode_the_point_and_its_interval(robot: Robot) -> None:
    surface = frequency_surface(robot, [9.0, 9.5], [11.0, 12.0, 13.0])
    assert surface.hz.shape == (2, 3)
    assert surface.hz[1, 1] == pytest.approx(linear_modes(robot)[1].hz)
    assert np.all(np.diff(surface.hz, axis=0) > 0)
    held = frequency_surface(robot, [9.5], [12.0], rotor_angle=np.pi / 2)
    assert held.hz[0, 0] == pytest.approx(linear_modes(robot, rotor_angle=np.pi / 2)[1].hz)
    identified = {"hinge_stiffness": STIFFNESS, "root_stiffness": ROOT}
    figure = figure_4_3(surface, identified, measured=(2.93, 0.0))
    shown = {line.get_label(): line.get_xydata() for line in figure.axes[0].lines}
    assert np.asarray(shown["stated"]).tolist() == [[9.5, 12.0]]
    (bars,) = figure.axes[0].containers
    segments = [np.asarray(s) for bar in bars[2] for s in bar.get_segments()]
    assert segments[0][:, 0] == pytest.approx([9.28, 9.32])
    assert segments[1][:, 1] == pytest.approx([12.0, 12.2])
    assert "measured, 2.930 Hz" in shown


def test_figures_4_4_and_4_5_show_measured_and_simulated_on_the_same_axes() -> None:
    t = np.linspace(0, 5, 50)
    columns = {name: k + 0.1 * np.sin(t) for k, name in enumerate((*FOOT, *TOP))}
    real, twin = TimeSeries.of(t, columns), TimeSeries.of(t, {n: 2 * c for n, c in columns.items()})
    pair = Pair("run", "17.0 rad/s", real, twin)
    figure = figure_4_4([pair, pair])
    measured, simulated = figure.axes[1].lines
    assert measured.get_ydata() == pytest.approx(1000 * columns[TOP[2]])
    assert simulated.get_ydata() == pytest.approx(2000 * columns[TOP[2]])
    assert [measured.get_color(), simulated.get_color()] == [palette.REAL, palette.TWIN]
    assert figure.axes[1].get_title(loc="left") == "17.0 rad/s"
    figure = figure_4_5(pair)
    assert drawn(figure, 0)[:, 0] == pytest.approx(columns[FOOT[0]])
    assert drawn(figure, 1)[:, 1] == pytest.approx(2 * columns[FOOT[2]])
    assert figure.axes[0].get_xlim() == figure.axes[1].get_xlim()
    assert [ax.lines[0].get_color() for ax in figure.axes] == [palette.REAL, palette.TWIN]


def test_the_sweep_figure_shows_amplitude_and_lag_and_its_marks() -> None:
    found = resonances([driven(w) for w in (6.0, 8.0, 14.0, 15.0)])
    figure = sweep_figure(found)
    shown = drawn(figure, 0)
    assert shown[:, 0] == pytest.approx([6.0, 8.0, 14.0, 15.0], abs=0.01)
    truth = [1000 * abs(answer(w)[0]) for w in (6.0, 8.0, 14.0, 15.0)]
    assert shown[:, 1] == pytest.approx(truth, rel=0.05)
    lag = drawn(figure, 2)[:, 1]
    assert lag[0] == pytest.approx(0, abs=10)
    assert abs(lag[2]) == pytest.approx(180, abs=10)
    assert figure.axes[0].get_ylim()[0] == 0
    with pytest.raises(InputError, match="amplitude and phase need a clamped sweep"):
        sweep_figure(resonances([released()]))


def test_the_damping_figure_shows_every_window_in_percent() -> None:
    modes = damping([released(seed=1), released(pull=0.03, seed=2)])
    figure = damping_figure(modes)
    shown = drawn(figure, 0)
    assert shown[:, 0] == pytest.approx([1000 * p.amplitude for p in modes[0].points])
    assert shown[:, 1] == pytest.approx([100 * p.ratio for p in modes[0].points])
    assert figure.axes[0].get_ylabel() == "damping ratio [%]"
    assert drawn(figure, 2)[:, 1] == pytest.approx([p.hz for p in modes[0].points])


def test_a_fitted_pair_is_the_run_and_what_the_fit_simulated(
    robot: Robot, ring: MeasuredRun, fitted: Identification
) -> None:
    (pair,) = fitted_pairs(fitted.fit, [ring])
    assert pair.label == "released from 0.2 N"
    part = ring.motion.between(float(pair.measured.times[0]) - 1e-6, np.inf)
    assert pair.measured[TOP[0]] == pytest.approx(part[TOP[0]])
    clean = simulate(robot, Condition("decay", np.zeros(400), rest=0.6, pull=0.2)).motion
    off = pair.simulated[TOP[2]] - clean.at(pair.simulated.times)[TOP[2]]
    assert len(off) > 300
    assert np.std(off) < NOISE_M  # the same swing, but for the place of the marker


def test_a_simulated_pair_starts_where_the_run_does(robot: Robot, ring: MeasuredRun) -> None:
    pair = simulated_pair(ring, robot)
    twin = pair.simulated.at(pair.measured.times)
    both = twin.validity(TOP[0]) & (pair.measured.times > 0)
    assert np.std(pair.measured[TOP[0]][both] - twin[TOP[0]][both]) < 3 * NOISE_M


def test_the_report_of_an_identification_tells_everything(
    tmp_path: Path, ring: MeasuredRun, fitted: Identification
) -> None:
    page = tmp_path / "report.html"
    validation = ReportPart(("Run", "Error"), [("held", "0.31 mm")], "One run was held out.")
    found = replace(fitted, not_determined=("a * b: only this product is determined",))
    write_identification(
        page, found, resonances([ring]), damping([released()]), validation,
        hop=Pair("hop", "17.0 rad/s", ring.motion, ring.motion), provenance={"ring": "abc123"},
    )  # fmt: skip
    text = page.read_text(encoding="utf-8")
    for words in (
        "k, stiffness of a hinge", "9.28 to 9.32", "-2.1 %", "k is far from &lt;stated",
        "0.31 mm", "only this product", "abc123", "Misfit in sigma", "ring",
        "other numbers, which moved within their tolerances", "top mass", "0.0887 to 0.0895",
    ):  # fmt: skip
        assert words in text, words
    assert text.count("<svg") == 5  # 4.4, 4.5, 4.3, 4.2 and damping; no sweep was given
    assert not re.search(r'(src|href)="(?!#)', text)
    write_identification(page, replace(found, estimates={}))
    assert "No run was held out, so nothing was validated." in page.read_text(encoding="utf-8")


def test_the_report_of_resonances_has_its_figures_and_verdict(tmp_path: Path) -> None:
    runs = [driven(w) for w in (8.0, 9.2, 10.6, 12.0)] + [released(name="let-go")]
    page = tmp_path / "report.html"
    write_resonances(page, "Sweep", runs, resonances(runs), damping(runs))
    text = page.read_text(encoding="utf-8")
    assert text.count("<svg") == 4
    assert f"torsional at {MODES[0].w0:.1f}"[:14] in text
    assert "let go, it rings at 1.59" in text
    assert "let-go" in text


def test_the_verb_tells_resonances_of_bundles_and_writes_the_report(
    tmp_path: Path, workbench
) -> None:
    carried_out(
        tmp_path,
        "  - run: {mode: decay, pull: 0.39 N, rest: 2 s, duration: 5 s}\n"
        "  - run: {mode: clamped, speed: 7 rad/s, rest: 2 s, duration: 6 s}\n",
    )
    page = tmp_path / "found.html"
    found = workbench("resonances", tmp_path / "runs", "--json", "--report", page)
    assert found.code == 0, found.err
    assert found.json["damping"][0]["oscillation"] == "torsional"
    assert found.json["damping"][0]["hz"] == pytest.approx(1.63, abs=0.02)
    assert found.json["points"][0]["speed_rad_s"] == pytest.approx(7.0, abs=0.05)
    assert page.exists()
    shown = workbench("resonances", *sorted((tmp_path / "runs").iterdir()))
    assert "strongest line of T's motion" in shown.out
    nothing = workbench("resonances", tmp_path)
    assert nothing.code == 2
    assert "not a bundle, it has no manifest.json" in nothing.err
