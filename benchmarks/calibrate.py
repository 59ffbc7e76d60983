"""The speed-voltage line from ten 10 s runs on the virtual bench: ours beside the thesis' way.

    python benchmarks/calibrate.py [--quick]

The thesis' way is a straight line by least squares through the speeds of Appendix C, the highest
bin of a Fourier transform. The truth is the virtual bench's own motor.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from motor_speed import motor_speed_fft, motor_speed_thesis
from numpy.typing import NDArray

from tests.bundles import manifest_of
from workbench.bundle import Bundle
from workbench.errors import InputError
from workbench.fit import measured_run
from workbench.identify import SpeedCalibration, SpeedPoint, calibrate, speed_points
from workbench.motion import ROTOR, ROTOR_ANGLE, TOP
from workbench.run import Experiment, QuietOperator, carry_out, load_bench
from workbench.run.bench import VirtualBench
from workbench.schemas import Protocol, load, load_model, load_shape, make_plan
from workbench.timeseries import TimeSeries
from workbench.tracking import mean_speed

PROTOCOL = Path(__file__).resolve().parents[1] / "protocols" / "speed-voltage.yaml"
RATE_HZ = 120.0
DRAWS = 200
BEND = 0.02  # of the span
SCATTER, OWN = 0.02, 0.005  # [rad/s]
SLOPE_BAR, OFFSET_BAR = 0.005, 0.03


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="Ours beside the thesis' speed-voltage line.")
    parser.add_argument("--quick", action="store_true", help="four runs of 5 s, 20 draws")
    quick = parser.parse_args().quick
    section = load_bench("virtual").content.virtual
    assert section is not None
    truth = (section.motor_slope, section.motor_offset)
    with tempfile.TemporaryDirectory() as folder:
        print_lines(run_all(Path(folder), quick), truth)
    print_draws(20 if quick else DRAWS, truth)


def run_all(folder: Path, quick: bool) -> list[Bundle]:
    """Carry the protocol out on the virtual bench."""
    protocol, bench = load(PROTOCOL, Protocol), load_bench("virtual")
    device = VirtualBench(bench.content)
    plan = make_plan(protocol, bench.content, device.voltage_step)
    if quick:
        fast = [run for run in plan.runs if float(run.action.name) > 5][:4]
        plan = replace(plan, items=tuple(replace(run, duration=5.0) for run in fast))
    model, shape = load_model("thesis", folder), load_shape("thesis-initial", folder)
    asked = Experiment(protocol, bench, model, shape, plan)
    return list(carry_out(asked, device, folder, QuietOperator(), lambda text: None))


def print_lines(bundles: list[Bundle], truth: tuple[float, float]) -> None:
    """Print slope, offset and speed errors of each way."""
    begin = time.perf_counter()
    found = calibrate(*speed_points(bundles))
    seconds = time.perf_counter() - begin
    assert found.line is not None, found.open
    print(f"truth: slope {truth[0]:g}, offset {truth[1]:g}; {len(bundles)} runs")
    print(f"{'way':34} {'slope':>9} {'off [%]':>9} {'offset':>9} {'off [rad/s]':>12}  bars")
    row("ours", found.line.slope.value, found.line.offset.value, truth)
    for name, speeds in other_speeds(bundles).items():
        volts = np.array([manifest_of(bundle)["voltage_V"] for bundle in bundles])
        slope, offset = np.polyfit(volts, speeds, 1)
        row(name, float(slope), float(offset), truth)
    print(f"ours: slope {interval(found, 'slope')}, offset {interval(found, 'offset')}")
    worst = max(abs(p.speed - truth[0] * p.voltage - truth[1]) for p in found.points)
    print(f"ours: worst speed off {worst:.5f} rad/s, scatter {found.line.scatter:.5f} rad/s")
    print(f"ours: found {[n for n, c in found.checks.items() if c.found] or 'nothing'}")
    print(f"ours: left out {[one.reason for one in found.omitted] or 'nothing'}; {seconds:.1f} s")


def row(name: str, slope: float, offset: float, truth: tuple[float, float]) -> None:
    """Print one way's line."""
    share, apart = slope / truth[0] - 1, offset - truth[1]
    held = abs(share) <= SLOPE_BAR and abs(apart) <= OFFSET_BAR
    print(
        f"{name:34} {slope:9.5f} {100 * share:+9.4f} {offset:9.5f} {apart:+12.5f}"
        f"  {'held' if held else 'missed'}"
    )


def interval(found: SpeedCalibration, name: str) -> str:
    """Return a parameter's 90 % interval as text."""
    one, unit = found.parameters[name]
    return f"{one.low:.5f} to {one.high:.5f} {unit}"


def other_speeds(bundles: list[Bundle]) -> dict[str, list[float]]:
    """Return the speed of every run by the ways that there were before."""
    out: dict[str, list[float]] = {
        "polyfit of the thesis' FFT": [],
        "polyfit of a Hann-window FFT": [],
        "polyfit of lines through the angle": [],
    }
    for bundle in bundles:
        run, track = measured_run(bundle), bundle.series.read("track")
        part = track.between(run.steps[-2][0] + 1.0, run.steps[-1][0])
        thesis = track.between(run.steps[0][0], track.times[-1])
        heights = filled(part, TOP[2]), filled(part, ROTOR[2])
        raw = run.motion.between(run.steps[-2][0] + 1.0, run.steps[-1][0] - 0.2)
        angle = np.where(raw.validity(ROTOR_ANGLE), raw[ROTOR_ANGLE], np.nan)
        ways = (
            lambda s=thesis: motor_speed_thesis(filled(s, TOP[2]), filled(s, ROTOR[2]), RATE_HZ),
            lambda h=heights: motor_speed_fft(h[0], h[1], RATE_HZ),
            lambda r=raw, a=angle: mean_speed(r.times, a).value,
        )
        for speeds, way in zip(out.values(), ways, strict=True):
            try:
                speeds.append(way())
            except InputError:
                speeds.append(float("nan"))
    return {name: speeds for name, speeds in out.items() if np.isfinite(speeds).all()}


def filled(series: TimeSeries, name: str) -> NDArray[np.float64]:
    """Return a channel with straight lines across its gaps, (n,); a transform needs them all."""
    seen = np.isfinite(series[name])
    return np.interp(series.times, series.times[seen], series[name][seen])


def print_draws(count: int, truth: tuple[float, float]) -> None:
    """Print coverage, false alarms and power over synthetic runs."""
    straight = [drawn(seed, truth, 0.0) for seed in range(count)]
    bent = [drawn(seed, truth, BEND) for seed in range(count)]
    lines = [one.line for one in straight if one.line is not None]
    for k, name in enumerate(("slope", "offset")):
        held = np.mean(
            [getattr(line, name).low <= truth[k] <= getattr(line, name).high for line in lines]
        )
        print(f"90 % interval of the {name} holds the truth in {100 * held:.0f} % of {count} draws")
    alarms = np.mean([one.checks["curvature"].found for one in straight])
    power = np.mean([one.checks["curvature"].found for one in bent])
    print(f"bent by 2 % of its span: found in {100 * power:.1f} %; straight: {100 * alarms:.1f} %")


def drawn(seed: int, truth: tuple[float, float], bend: float) -> SpeedCalibration:
    """Return the calibration of ten drawn runs."""
    rng = np.random.default_rng(seed)
    volts = np.linspace(1.2, 5.0, 10)
    share = (volts - volts[0]) / np.ptp(volts)
    speeds = truth[0] * volts + truth[1] + bend * truth[0] * np.ptp(volts) * 4 * share * (1 - share)
    speeds = speeds + rng.normal(0, np.hypot(SCATTER, OWN), len(volts))
    pairs = zip(volts.tolist(), speeds.tolist(), strict=True)
    return calibrate([SpeedPoint(str(k), v, s, OWN) for k, (v, s) in enumerate(pairs)])


if __name__ == "__main__":
    main()
