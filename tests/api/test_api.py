"""What `import workbench` offers, how it answers wrong words; it agrees with the commands."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import workbench as wb
from tests.conftest import Command
from workbench import api
from workbench.errors import InputError, WorkbenchError

ROOT = Path(__file__).resolve().parents[2]
TAKE = ROOT / "tests" / "data" / "tracking" / "hop_motive_1.23.csv"
LAB = ROOT / "docs" / "examples" / "lab-bench.yaml"
HOP = ROOT / "protocols" / "hop-17.yaml"
MOST_LINES = 5
any_word: Any = str


def test_the_package_offers_what_its_room_does_and_each_name_says_how() -> None:
    assert vars(wb)["__all__"] == dir(wb) == dir(api)
    for name in dir(wb):
        one = getattr(wb, name)
        assert one is getattr(api, name)
        methods = [one] if inspect.isfunction(one) else [m for _, m in inspect.getmembers(one)]
        for method in methods:
            if inspect.isfunction(method) and not method.__name__.startswith("_"):
                text = inspect.getdoc(method) or ""
                given = set(inspect.signature(method).parameters) - {"self"}
                assert all(f"    {word}: " in text for word in given), (name, method.__name__)
                assert not given or "Example:" in text or name == "Simulated", method.__name__


def test_a_name_that_does_not_exist_is_answered_with_one_that_does() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'open_rn'; did you mean 'open_run'\?"):
        _ = wb.open_rn  # pyright: ignore[reportAttributeAccessIssue]


def test_a_run_prints_in_few_lines_and_hands_out_its_series(finished: Path) -> None:
    run = wb.open_run("hop", folder=finished)
    lines = repr(run).splitlines()
    assert lines[0] == f"Run {run.name}: hop 17 rad/s, train, complete"
    assert lines[1].startswith(f"  real: distance {run.summary['real']['distance_m']:.3f} m, ")
    assert lines[2].endswith(f"error {run.summary['error_mm']:.1f} mm rms")
    assert lines[3:] == ["  series: supply, raw, track, twin, state"]
    track, raw = run.series("track"), run.table("raw")
    assert run.table().column_names == ["time_s", *track.names]
    seen, column = track.validity("foot_x_m"), run.table()["foot_x_m"].to_numpy()
    assert np.array_equal(column[seen], track["foot_x_m"][seen])
    unseen = run.series("raw")
    for name in unseen.names:
        lost = ~unseen.validity(name) | np.isnan(unseen[name])
        assert raw[name].null_count == np.count_nonzero(lost)
    assert raw["top_x_m"].null_count > 0
    assert run.table("supply")["current_A"].null_count == 0
    assert len(run.take()) > 0


def test_runs_are_a_tuple_and_one_table(finished: Path) -> None:
    runs = wb.open_runs(folder=finished)
    assert repr(runs).splitlines()[:2] == ["2 runs: 2 complete", "1 hop 17 rad/s, 1 decay 0.4 N"]
    table = runs.table()
    assert table["mode"].to_pylist() == ["hop", "decay"]
    hop, decay = table["real_distance_m"].to_pylist()
    assert hop == runs[0].summary["real"]["distance_m"]
    assert decay is None, "a released robot hops no distance"
    only = wb.Runs(run for run in runs if run.asked.mode == "decay")
    assert repr(only).splitlines()[0] == "1 run: 1 complete"
    assert repr(wb.Runs()) == "0 runs"
    assert wb.open_runs("decay", folder=finished)[0].name == only[0].name


def test_a_twin_turned_as_measured_is_nearer_than_one_as_commanded(finished: Path) -> None:
    run = wb.open_run("decay", folder=finished)
    nominal = run.twin()
    softer = run.twin(parameters={"hinge_stiffness": 9.31, "hinge_damping": 0.0036})
    assert softer.noise_mm < softer.rms_mm < nominal.rms_mm < run.summary["error_top_mm"]
    assert len(repr(nominal).splitlines()) <= MOST_LINES


def test_a_simulation_is_that_of_the_command(workbench: Command) -> None:
    words = ("--omega", 16, "--duration", 2, "--spread", 3, "--slope", 1, "--json")
    printed = workbench("simulate", *words).json
    done = wb.simulate(16, 2, slope=np.radians(1))
    assert json.loads(json.dumps(done.summary)) == {key: printed[key] for key in done.summary}
    assert done.spread(3).as_json() == printed["distance_spread"]
    assert done.table()["time_s"][-1].as_py() == printed["simulated_s"]
    assert len(repr(done).splitlines()) <= MOST_LINES
    lighter = wb.simulate(16, 2, slope=np.radians(1), parameters={"top_mass": 0.08})
    assert lighter.summary["distance_m"] != done.summary["distance_m"]


def test_a_take_shows_what_was_not_seen_as_null(workbench: Command) -> None:
    take = wb.read_take(TAKE)
    assert wb.take_quality(take) | {"guess": None} == workbench("ingest", TAKE, "--json").json | {
        "guess": None
    }
    lines = repr(take).splitlines()
    assert "motive 1.23, 40 frames at 120 Hz" in lines[0]
    assert lines[1] == "  bodies: Foot (seen 92.5%), T (seen 100.0%), Rotor (seen 70.0%)"
    poses = take.poses("Rotor").table()
    assert poses["Rotor_x_m"].null_count == wb.take_quality(take)["bodies"]["Rotor"]["missing"] > 0
    seen = take.bodies["T"]
    both = np.column_stack([take.poses("T")[f"T_{end}"] for end in ("x_m", "y_m", "z_m", "qw")])
    assert np.array_equal(both, np.column_stack([seen.position, seen.quaternion[:, 0]]))


SHEET = """\
schema: workbench/sheet-1
model: thesis
shape: thesis-initial
tracking: {{up: y, forward: -z}}
bodies: {{foot: Foot, top: T, rotor: Rotor}}
runs:
  - {{take: "{take}", mode: decay, pull: 0.4 N, rest: 1 s, duration: 3 s, role: held_out}}
"""


def test_a_sheet_makes_runs_of_takes(finished: Path, tmp_path: Path) -> None:
    at_bench = wb.open_run("decay", folder=finished)
    sheet, stages = tmp_path / "sheet.yaml", list[str]()
    sheet.write_text(SHEET.format(take=at_bench.bundle.take().resolve()), "utf-8")
    (run,) = wb.ingest_sheet(sheet, tmp_path / "runs", stages.append)
    assert (run.status, run.asked.role, len(stages)) == ("complete", "held_out", 1)
    assert run.summary["real"] == pytest.approx(at_bench.summary["real"], rel=0.01)
    assert wb.open_runs(folder=tmp_path / "runs")[0].name == run.name


def test_the_page_shows_every_function() -> None:
    page = (ROOT / "docs" / "reference" / "python.md").read_text("utf-8")
    shown = [name for name in dir(wb) if f"wb.{name}(" in page or f"`{name}`" in page]
    assert shown == [name for name in dir(wb) if name not in ("Run", "Simulated")]


WRONG: dict[str, tuple[Callable[[Path], object], str]] = {
    "mode": (lambda _: wb.simulate(mode=any_word("clmped")), "did you mean 'clamped'.*hop, clamp"),
    "parameter": (lambda _: wb.simulate(parameters={"top_mas": 1}), "did you mean 'top_mass'"),
    "model": (lambda _: wb.simulate(model="tesis"), "did you mean 'thesis'"),
    "shape": (lambda _: wb.simulate(shape="thesis-inital"), "did you mean 'thesis-initial'"),
    "omega": (lambda _: wb.simulate(omega=100), "omega 100 rad/s is outside -60 to 60 rad/s"),
    "duration": (lambda _: wb.simulate(duration=0), "duration 0 s is outside 0.1 to 600 s"),
    "spread": (lambda _: wb.simulate(17, 0.2, mode="drop").spread(), "only a hop's distance"),
    "run": (lambda f: wb.open_run("hopp-16.99", f), "no run.*; did you mean '.*hop-16.99'"),
    "runs": (lambda f: wb.open_runs("clamped", folder=f), "which holds 2 runs"),
    "series": (lambda f: wb.open_run("hop", f).table(any_word("trak")), "did you mean 'track'"),
    "of twin": (lambda f: wb.open_run("hop", f).twin("tesis"), "did you mean 'thesis'"),
    "to fit": (lambda f: wb.open_runs(folder=f).fit("top_mas"), "did you mean 'top_mass'"),
    "no run": (lambda _: wb.Runs().fit(), "none of these runs is complete"),
    "to judge": (lambda f: wb.open_runs("hop", folder=f).diagnose(f.parent / "d"), "held_out"),
    "body": (lambda _: wb.read_take(TAKE).poses("rotor"), "no body 'rotor'; did you mean 'Rotor'"),
    "export": (lambda _: wb.read_take("nowhere.csv"), "nowhere.csv"),
    "bench": (lambda f: wb.run_protocol(HOP, "virtul", f), "did you mean 'virtual'"),
    "no virtual bench": (lambda f: wb.run_protocol(HOP, LAB, f), "type `workbench run "),
    "protocol": (lambda f: wb.run_protocol("hop.yaml", folder=f), "hop.yaml: no such file"),
    "sheet": (lambda f: wb.ingest_sheet("sheet.yaml", f), "sheet.yaml: no such file"),
    "goal": (lambda _: wb.optimize_shape(goal="distnce"), "did you mean 'distance'"),
    "algorithm": (lambda _: wb.optimize_shape(algorithm="guide"), "did you mean 'guided'"),
    "bounds": (lambda _: wb.optimize_shape(bounds="apendix-e"), "did you mean 'appendix-e'"),
    "varied": (lambda f: wb.optimize_shape(vary=["top_mas=0:1"], out=f.parent / "s"), "'top_mass'"),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_word_is_refused_with_the_right_ones(what: str, finished: Path) -> None:
    call, message = WRONG[what]
    with pytest.raises(WorkbenchError, match=message) as refused:
        call(finished)
    assert isinstance(refused.value, InputError)
