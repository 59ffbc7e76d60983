"""Sweeps, spectra, peaks and jumps against a linear robot in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_robot import BOUNCE, RATE, REST, SWAY, answer, driven, path, released
from numpy.typing import NDArray

from workbench.errors import InputError
from workbench.fit import MeasuredRun
from workbench.identify import SweepPoint, resonances
from workbench.identify.resonance import find_jumps, find_peaks
from workbench.identify.spectrum import spectrum
from workbench.identify.sweep import plateaus, read_sweep
from workbench.motion import ORDERS, ROTOR_ANGLE, TOP
from workbench.timeseries import TimeSeries

SPEEDS = (6.0, 7.5, 9.0, 9.6, 10.5, 12.0, 14.0, 16.0, 17.3, 18.6, 20.0)
FIRST, HALF = ORDERS.index(1.0), ORDERS.index(0.5)


@pytest.fixture(scope="module")
def measured() -> tuple[SweepPoint, ...]:
    """Ten seconds from rest at each speed, up and then down."""
    speeds = (*SPEEDS, *SPEEDS[::-1])
    runs = [driven(w, seed=k, name=f"run-{k}") for k, w in enumerate(speeds)]
    return read_sweep(runs).points


def exact(w: float, direction: str = "up") -> SweepPoint:
    """The linear robot's answer without a run, with 0.05 mm of error."""
    full = np.zeros((2, len(ORDERS)), complex)
    full[:, FIRST] = answer(w)
    return SweepPoint(f"at-{w:g}", 4.0, 10.0, direction, w, 1e-3, full,  # pyright: ignore[reportArgumentType]
                      np.full(full.shape, 5e-5), np.zeros(full.shape),
                      np.full(full.shape, True))  # fmt: skip


def scaled(point: SweepPoint, factor: float) -> SweepPoint:
    return replace(point, answer=factor * point.answer)


def test_amplitude_and_phase_are_those_of_closed_form_within_their_errors(
    measured: tuple[SweepPoint, ...],
) -> None:
    off, sure = [], []
    for point in measured:
        truth = answer(point.speed)
        parts = (point.answer[:, FIRST] - truth) / point.error[:, FIRST]
        off += [*parts.real, *parts.imag]
        if min(abs(point.speed - mode.w0) for mode in (SWAY, BOUNCE)) > 1.2:
            apart = np.abs(point.answer[:, FIRST] - truth).max()
            sure.append(apart / np.abs(truth).max())
            assert np.exp(1j * point.lag) == pytest.approx(
                np.exp(-1j * np.angle(truth / np.array([1, 1j]))),
                abs=max(0.02, 4 * (point.amplitude_error() / point.amplitude()).max()),
            )
    assert np.sqrt(np.mean(np.square(off))) < 2
    assert max(sure) < 0.02  # off resonance, after ten seconds from rest


def test_the_swings_of_its_own_would_spoil_the_answer_if_they_were_not_told_apart() -> None:
    run = driven(14.0, seed=3)
    late = run.motion.between(4, 10)
    terms = np.column_stack([f(14.0 * late.times) for f in (np.cos, np.sin, np.ones_like)])
    plain = np.hypot(*np.linalg.lstsq(terms, late[TOP[0]])[0][:2])
    (point,) = read_sweep([run]).points
    truth = abs(answer(14.0)[0])
    assert abs(plain / truth - 1) > 5 * abs(point.amplitude()[0] / truth - 1)


def test_a_rotor_that_turns_backwards_gives_the_same_amplitudes() -> None:
    run = driven(14.0, seed=3)
    back = {name: run.motion[name] for name in run.motion.names}
    back[ROTOR_ANGLE] = -back[ROTOR_ANGLE]
    (forth,), (point,) = (
        read_sweep([r]).points
        for r in (run, replace(run, motion=TimeSeries.of(run.motion.times, back)))
    )
    assert point.speed == pytest.approx(14.0, abs=0.01)
    assert point.amplitude() == pytest.approx(forth.amplitude())


def test_speeds_are_up_then_down_in_the_order_of_time(measured: tuple[SweepPoint, ...]) -> None:
    assert [p.direction for p in measured] == ["up"] * len(SPEEDS) + ["down"] * len(SPEEDS)
    jumbled = read_sweep([driven(w, 6.0) for w in (8.0, 14.0, 6.0, 12.0)]).points
    assert {p.direction for p in jumbled} == {"unordered"}
    again = read_sweep([driven(w, 6.0, name=f"{w}-{k}") for w in (8.0, 12.0, 14.0) for k in (1, 2)])
    assert {p.direction for p in again.points} == {"up"}


def test_a_staircase_gives_a_point_for_each_step() -> None:
    parts = [driven(w, 12.0, seed=k) for k, w in enumerate((7.0, 14.0, 7.5))]
    t = np.arange(3 * len(parts[0].motion)) / RATE
    columns = {n: np.concatenate([p.motion[n] for p in parts]) for n in parts[0].motion.names}
    angle = [np.interp(t, (0, 12, 24, 36), (0, 84, 84 + 168, 84 + 168 + 90))]
    columns[ROTOR_ANGLE] = angle[0]
    steps = ((0.0, 7.0), (12.0, 14.0), (24.0, 7.5), (36.0, 0.0))
    run = MeasuredRun("stairs", "clamped", TimeSeries.of(t, columns), steps)
    assert [p.speed for p in plateaus(run)] == [7.0, 14.0, 7.5]
    points = read_sweep([run]).points
    assert [p.speed for p in points] == pytest.approx([7.0, 14.0, 7.5], abs=0.01)
    assert [p.direction for p in points] == ["up", "up", "down"]
    for point in points:
        assert point.amplitude() == pytest.approx(np.abs(answer(point.speed)), rel=0.1)
    assert points[1].start == pytest.approx(18.0, abs=0.1)


def test_half_the_rotor_s_speed_is_told_and_marked_as_a_doubled_period() -> None:
    run = driven(23.0, seed=1)
    columns = {n: run.motion[n].copy() for n in run.motion.names}
    columns[TOP[0]] += 0.03 * np.cos(11.5 * run.motion.times + 0.4)
    doubled = replace(run, motion=TimeSeries.of(run.motion.times, columns))
    (point,) = read_sweep([doubled]).points
    assert point.amplitude(0.5)[0] == pytest.approx(0.03, rel=0.02)
    assert np.angle(point.answer[0, HALF]) == pytest.approx(0.4, abs=0.02)
    (jump,) = find_jumps([point])
    assert jump.kind == "period doubled"
    assert "half the rotor's speed" in str(jump)
    assert not list(find_jumps(read_sweep([run]).points))


def test_a_swing_of_its_own_that_fades_at_half_the_rotor_s_speed_is_no_doubled_period() -> None:
    run = driven(20.0, seed=1)
    columns = {n: run.motion[n].copy() for n in run.motion.names}
    times = run.motion.times
    own = 0.06 * np.exp(-0.1 * times) * np.cos(10 * times)
    columns[TOP[0]] = REST[0] + own + 0.01 * np.cos(20 * times)
    (point,) = read_sweep([replace(run, motion=TimeSeries.of(times, columns))]).points
    assert point.amplitude(0.5)[0] > point.amplitude().max()
    assert point.change == pytest.approx(np.exp(-0.3) - 1, abs=0.03)
    assert not list(find_jumps([point]))


def test_an_answer_that_still_grows_is_not_steady_and_unsure_by_its_growth() -> None:
    (point,) = read_sweep([driven(SWAY.w0)]).points
    assert not point.steady
    assert point.change > 0.1
    assert point.amplitude()[0] < 0.8 * abs(answer(SWAY.w0)[0])
    assert point.amplitude_error()[0] > 0.1 * point.amplitude()[0]
    assert read_sweep([driven(14.0)]).points[0].steady


def test_a_run_that_fell_is_left_out_with_its_reason() -> None:
    run = driven(14.0)
    hidden = {TOP[0]: run.motion.times < 5}
    columns = {n: run.motion[n] for n in run.motion.names}
    fell = replace(run, motion=TimeSeries.of(run.motion.times, columns, hidden))
    points, warnings = read_sweep([fell])
    assert points == ()
    assert "run-14 at 14.00 rad/s: T and rotor are seen in only" in warnings[0]


def test_peaks_are_the_oscillators_and_have_the_thesis_names(
    measured: tuple[SweepPoint, ...],
) -> None:
    peaks = list(find_peaks(measured))
    assert [(p.direction, p.oscillation) for p in peaks] == [
        ("up", "torsional"),
        ("up", "longitudinal"),
        ("down", "torsional"),
        ("down", "longitudinal"),
    ]
    for peak, mode in zip(peaks, (SWAY, BOUNCE) * 2, strict=True):
        assert peak.fitted
        assert peak.speed == pytest.approx(mode.w0, rel=0.01)
        assert abs(peak.speed - mode.w0) < 4 * peak.speed_error
        assert peak.damping_ratio == pytest.approx(mode.ratio, abs=0.01)
        assert peak.hz == pytest.approx(peak.speed / (2 * np.pi))


def test_the_place_of_an_exact_peak_is_found_between_coarse_speeds() -> None:
    points = [exact(w) for w in (8.0, 9.2, 10.6, 12.0)]
    (peak,) = find_peaks(points)
    assert peak.speed == pytest.approx(SWAY.w0, rel=2e-3)
    assert peak.damping_ratio == pytest.approx(SWAY.ratio, rel=0.5)


def test_an_answer_that_bends_is_not_taken_for_an_oscillator() -> None:
    """The upper branch of a hardening spring: it peaks where its backbone ends, in phase."""
    sizes = {6.0: 2.1, 8.0: 6.2, 10.0: 27.0, 12.0: 8.0, 14.0: 5.4}
    bent = [scaled(exact(w), 1e-3 * s / float(np.linalg.norm(answer(w)))) for w, s in sizes.items()]
    bent[2] = replace(bent[2], answer=3 * bent[1].answer)
    (peak,) = find_peaks(bent)
    assert not peak.fitted
    assert peak.damping_ratio is None
    assert peak.speed == 10.0
    assert peak.speed_error == pytest.approx(4 / np.sqrt(12))


def test_a_smooth_resonance_is_no_jump(measured: tuple[SweepPoint, ...]) -> None:
    assert not list(find_jumps(measured))
    for step in (0.25, 0.5, 1.0, 1.5):
        points = [exact(w) for w in np.arange(6.0, 22.0, step)]
        assert not list(find_jumps(points)), step


def test_a_jump_along_the_sweep_is_marked_where_it_is() -> None:
    speeds = np.arange(6.0, 9.1, 0.5)
    points = [exact(w) if w < 7.7 else scaled(exact(w), 0.3) for w in speeds]
    (jump,) = find_jumps(points)
    assert jump.kind == "along the sweep"
    assert jump.speeds == (7.5, 8.0)
    assert jump.amplitudes[0] > jump.amplitudes[1]
    assert "sweep up: T's amplitude goes from" in str(jump)


def test_runs_in_random_order_follow_no_branch_and_so_leave_none() -> None:
    speeds = (11.0, 12.0, 13.0, 14.0, 15.0, 16.0)
    there = [scaled(exact(w, "unordered"), 3.0 if w > 13.5 else 1.0) for w in speeds]
    assert list(find_jumps(there)) == []
    assert list(find_jumps([replace(point, direction="up") for point in there])) != []


def test_repeats_count_as_their_mean_and_widen_its_error() -> None:
    points = [exact(w) for w in (8.0, 9.2, 10.6, 12.0)]
    more = [p for point in points for p in (scaled(point, 0.99), scaled(point, 1.01))]
    (peak,), (alone,) = list(find_peaks(more)), list(find_peaks(points))
    assert peak.speed == pytest.approx(alone.speed, rel=0.01)
    assert peak.speed_error > 2 * alone.speed_error


def test_up_against_down_is_marked_only_where_they_differ_by_more_than_errors() -> None:
    speeds = np.arange(6.0, 9.1, 0.5)
    up = [exact(w) for w in speeds]
    down = [scaled(exact(w, "down"), 1.6 if w in (7.5,) else 1.005) for w in speeds[::-1]]
    (jump,) = (j for j in find_jumps([*up, *down]) if j.kind == "up against down")
    assert jump.speeds == (7.5, 7.5)
    assert jump.amplitudes[1] / jump.amplitudes[0] == pytest.approx(1.6)
    unsure = [replace(p, error=0 * p.error + 0.02) for p in down]
    assert not [j for j in find_jumps([*up, *unsure]) if j.kind == "up against down"]


def test_the_peak_beside_a_jump_is_not_an_oscillator() -> None:
    speeds = np.arange(7.0, 13.1, 0.5)
    points = [exact(w) if w < 9.7 else scaled(exact(w), 0.1) for w in speeds]
    (peak,) = find_peaks(points)
    assert not peak.fitted
    assert peak.speed == 9.5
    assert peak.speed_error == pytest.approx(1 / np.sqrt(12))


def lines_of(noise: float, seed: int) -> NDArray[np.float64]:
    """Frequencies of the two lines of a steady motion in noise, (2,) [Hz]."""
    t = np.arange(0, 10, 1 / RATE)
    rng = np.random.default_rng(seed)
    x = 0.02 * np.cos(2 * np.pi * 1.31 * t) + 0.004 * np.cos(2 * np.pi * 3.2 * t)
    z = 0.006 * np.sin(2 * np.pi * 1.31 * t) + 0.012 * np.cos(2 * np.pi * 3.2 * t)
    columns = {
        TOP[0]: x + rng.normal(0, noise, len(t)),
        TOP[1]: 0 * t,
        TOP[2]: z + rng.normal(0, noise, len(t)),
    }
    found = spectrum(MeasuredRun("steady", "decay", TimeSeries.of(t, columns)))
    assert [line.oscillation for line in found.lines[:2]] == ["torsional", "longitudinal"]
    assert found.lines[0].amplitude == pytest.approx((0.02, 0.006), rel=0.02, abs=3 * noise)
    return np.array([[line.hz, line.hz_error] for line in found.lines[:2]]).ravel()


def test_lines_are_placed_between_the_bins_with_honest_errors() -> None:
    drawn = np.array([lines_of(1e-3, seed) for seed in range(60)])
    truth = (1.31, 3.2)
    for k in range(2):
        hz, stated = drawn[:, 2 * k], drawn[:, 2 * k + 1]
        assert np.mean(hz) == pytest.approx(truth[k], rel=1e-3)
        assert np.std(hz) / np.mean(stated) == pytest.approx(1, abs=0.35)


def test_the_rotor_s_own_line_and_an_overtone_have_their_names() -> None:
    steady = driven(14.0)
    assert spectrum(steady).lines[0].name == "rotor"
    assert "torsional" in [line.name for line in spectrum(steady).lines]
    t = np.arange(0, 10, 1 / RATE)
    x = 0.02 * np.cos(10 * t) + 0.003 * np.cos(20 * t)
    bent = TimeSeries.of(t, {TOP[0]: x, TOP[1]: 0 * t, TOP[2]: 0 * t})
    assert [line.name for line in spectrum(MeasuredRun("bent", "decay", bent)).lines] == [
        "torsional",
        "overtone",
    ]


def test_no_run_that_can_be_looked_at_is_an_error_that_says_why() -> None:
    with pytest.raises(InputError, match="no clamped run is given; amplitude and phase"):
        read_sweep([released()])
    with pytest.raises(InputError, match=r"ring-0\.015: T is seen for 1\.0 s .* needs 2 s"):
        resonances([released(1.0)])


def test_everything_comes_as_json() -> None:
    found = resonances([driven(8.0), driven(14.0), released()]).as_json()
    assert [p["speed_rad_s"] for p in found["points"]] == pytest.approx([8, 14], abs=0.01)
    assert found["points"][0]["amplitude_x_m"][FIRST] == pytest.approx(abs(answer(8.0)[0]), rel=0.1)
    assert found["lines"]["ring-0.015"][0]["hz"] == pytest.approx(10 / (2 * np.pi), rel=2e-3)


def test_the_closed_form_starts_from_rest() -> None:
    t = np.arange(0, 0.01, 1e-4)
    assert np.abs(path(t, 14.0)).max() < 1e-3 * np.abs(answer(14.0)).max() * 20
