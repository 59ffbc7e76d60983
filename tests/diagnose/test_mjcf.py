"""Any MJCF model as a rig: known truths, the examples' own equations, and what is refused."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import mujoco
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from workbench.diagnose import MjcfRig, load_rig
from workbench.diagnose.layout import Layout
from workbench.diagnose.mjcf_numbers import set_field
from workbench.diagnose.noise import noise_of
from workbench.diagnose.problem import Problem
from workbench.errors import FileFaults, InputError

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
RATE = 100

MODEL = """
<mujoco>
  <option timestep="0.002" integrator="RK4" gravity="0 0 0"/>
  <worldbody>
    <body name="cart">
      <joint name="rail" type="slide" axis="1 0 0" stiffness="80" damping="0.5"/>
      <geom type="box" size="0.04 0.03 0.02" mass="0.5"/>
      <body name="tip" pos="0 0 0.3"><site name="mark" pos="0 0 0.1"/></body>
    </body>
    <body name="ball" pos="1 0 0"><joint name="loose" type="ball"/><geom size="0.1"/></body>
  </worldbody>
  <actuator><motor name="coil" joint="rail"/></actuator>
</mujoco>
"""
RIG = """\
schema: workbench/rig-1
name: cart
model: cart.xml
parameters:
  - {joint: rail, field: stiffness, value: 80, tolerance: 4, unit: N/m}
  - {body: cart, field: mass, tolerance: 0.01, unit: kg}
channels:
  place: {joint: rail}
  speed: {joint: rail, quantity: velocity}
  mark: {site: mark, axis: x, column: mark_mm, scale: 0.001}
inputs:
  force: {actuator: coil, between: curve}
runs:
  - {data: run.csv, begins: 0.5 s, start: {rail: 0.02}}
  - {data: run.csv, name: again, begins: 0.5 s, start: {rail: held}, role: held_out}
effects:
  joints:
    rail: {stiffness: 8, even_stiffness: 500, cubic_stiffness: 5000, rest_shift: 0.005,
           damping: 0.3, quadratic_damping: 1, cubic_damping: 3, coulomb_friction: 0.05}
  bodies:
    cart: {mass: 0.05}
  channels:
    place: {offset: 0.001, gain: 0.01, delay: 0.01}
  inputs:
    force: {offset: 0.05, gain: 0.05, delay: 0.01}
"""


def force(t: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.where(t > 0, 0.4 * np.sin(9 * t) * np.minimum(t, 1), 0.0)


def simulated(**numbers: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Place and speed of the cart over 3 s from 0.02 m, by a plain loop over `mj_step`."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    for name, value in numbers.items():
        getattr(model, name)[0] = value
    data = mujoco.MjData(model)
    data.qpos[0] = 0.02
    steps = round(1 / RATE / model.opt.timestep)
    stamps = np.arange(-50, 311) / RATE
    curve = CubicSpline(stamps, force(stamps))
    places, speeds = [], []
    for k in range(301 * steps):
        if k % steps == 0:
            places.append(data.qpos[0])
            speeds.append(data.qvel[0])
        data.ctrl[0] = curve((k + 0.5) * model.opt.timestep)
        mujoco.mj_step(model, data)
    return np.array(places), np.array(speeds)


def columns() -> dict[str, NDArray[np.float64]]:
    places, speeds = simulated()
    times = np.arange(-50, 311) / RATE
    still = np.zeros(50)
    place = np.concatenate([still + 0.02, places, np.full(10, places[-1])])
    speed = np.concatenate([still, speeds, np.zeros(10)])
    return {
        "time_s": times + 0.5, "place": place, "speed": speed, "mark_mm": 1000 * place,
        "force": force(times),
    }  # fmt: skip


@pytest.fixture(scope="module")
def table() -> dict[str, NDArray[np.float64]]:
    return columns()


@pytest.fixture
def folder(tmp_path: Path, table: dict[str, NDArray[np.float64]]) -> Path:
    (tmp_path / "cart.xml").write_text(MODEL)
    (tmp_path / "rig.yaml").write_text(RIG)
    write(tmp_path / "run.csv", table)
    return tmp_path


def write(path: Path, table: dict[str, NDArray[np.float64]]) -> None:
    rows = np.column_stack(list(table.values()))
    np.savetxt(path, rows, "%.17g", ",", header=",".join(table), comments="")


def changed(folder: Path, old: str, new: str) -> Path:
    assert old in RIG
    path = folder / "rig.yaml"
    path.write_text(RIG.replace(old, new))
    return path


@pytest.fixture
def rig(folder: Path) -> MjcfRig:
    return load_rig(folder / "rig.yaml")


def test_a_rig_predicts_its_own_simulation_exactly(rig: MjcfRig) -> None:
    seen = rig.runs[0]
    assert seen.channels == ("place", "speed", "mark")
    assert seen.units == ("m", "m/s", "m")
    moved = seen.times <= 3.0
    for predicted in rig.predict([(0, {}), (1, {})]):
        assert predicted[moved] == pytest.approx(seen.values[moved], abs=1e-12)


def test_until_and_coarse_and_company_change_nothing_but_what_they_say(rig: MjcfRig) -> None:
    whole = rig.predict([(0, {})])[0]
    company = [(0, {"rail_stiffness": 80.0 + k}) for k in range(1, 18)]
    assert np.array_equal(rig.predict([*company, (0, {})])[-1], whole)
    short = rig.predict([(0, {})], until=1.0)[0]
    assert len(short) == np.count_nonzero(rig.runs[0].times <= 1.0)
    assert short == pytest.approx(whole[: len(short)], abs=1e-9)
    coarse = rig.predict([(0, {})], coarse=True)[0]
    assert 0 < np.abs(coarse - whole).max() < 1e-4


@pytest.mark.parametrize(
    ("name", "field", "value", "given"),
    [
        ("rail_stiffness", "jnt_stiffness", 83.0, 83.0),
        ("rail_stiffness.k", "jnt_stiffness", 83.0, 3.0),
        ("rail_even_stiffness.k2", "jnt_stiffnesspoly", [300, 0], 300.0),
        ("rail_cubic_stiffness.k3", "jnt_stiffnesspoly", [0, 4e4], 4e4),
        ("rail_rest_shift.shift", "qpos_spring", 0.004, 0.004),
        ("rail_damping.d", "dof_damping", 0.8, 0.3),
        ("rail_quadratic_damping.d2", "dof_dampingpoly", [2, 0], 2.0),
        ("rail_cubic_damping.d3", "dof_dampingpoly", [0, 5], 5.0),
    ],
)
def test_a_number_or_cause_is_the_engine_s_own_field(
    rig: MjcfRig, name: str, field: str, value: float, given: float
) -> None:
    places, speeds = simulated(**{field: value})
    predicted = rig.predict([(0, {name: given})])[0]
    assert predicted[:301, 0] == pytest.approx(places, abs=1e-12)
    assert predicted[:301, 1] == pytest.approx(speeds, abs=1e-12)
    assert np.abs(predicted[:301, 0] - simulated()[0]).max() > 1e-5


def test_mass_takes_its_inertia_along_and_both_ways_to_it_agree(rig: MjcfRig) -> None:
    base, cause = rig.predict([(0, {"cart_mass": 0.55}), (0, {"cart_mass.mass": 0.05})])
    assert base == pytest.approx(cause, abs=1e-12)
    heavier, stiffer = rig.predict(  # with gravity off only ratios to the mass count
        [
            (0, {"cart_mass": 1.0, "rail_stiffness": 160.0, "rail_damping.d": 0.5,
                 "force_gain.share": 1.0}),
            (0, {}),
        ]
    )  # fmt: skip
    assert heavier == pytest.approx(stiffer, abs=1e-12)


def test_a_heavier_body_turns_as_much_more_slowly() -> None:
    model = mujoco.MjModel.from_xml_string(MODEL.replace('type="slide" axis="1', 'axis="1'))
    set_field(model, "mass", model.body("cart").id, 1.0)
    mujoco.mj_setConst(model, mujoco.MjData(model))
    about = 1.0 * (0.06**2 + 0.04**2) / 12  # of the box about x, through its centre
    assert model.dof_M0[0] == pytest.approx(about, rel=1e-9)


def test_a_simulation_that_blows_up_repeats_its_last_samples_and_writes_no_log(
    rig: MjcfRig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = set(tmp_path.iterdir())
    predicted = rig.predict([(0, {"rail_stiffness": 1e9}), (0, {})])
    assert np.isfinite(predicted[0]).all()
    assert np.ptp(predicted[0][-50:, 0]) < 1e-9 * np.abs(predicted[0]).max()
    assert np.array_equal(predicted[1], rig.predict([(0, {})])[0])
    assert set(tmp_path.iterdir()) == before


def test_dry_friction_takes_the_same_from_every_half_swing(rig: MjcfRig) -> None:
    """Amplitude falls by 2 friction / stiffness each half swing, whatever it is."""
    dry = {"rail_coulomb_friction.friction": 0.05, "rail_damping.d": -0.495}
    dry |= {"force_gain.share": -0.99}
    place = rig.predict([(0, dry)])[0][:, 0]
    inner = place[1:-1]
    turns = np.flatnonzero((inner - place[:-2]) * (place[2:] - inner) < 0)
    peaks = np.abs(inner[turns])
    assert len(peaks) >= 6
    assert -np.diff(peaks[:6]) == pytest.approx(2 * 0.05 / 80, rel=0.1)


def test_channels_may_err_in_place_size_and_time(rig: MjcfRig) -> None:
    times = rig.runs[0].times
    plain, offset, gain, late = (
        found[:, 0]
        for found in rig.predict(
            [(0, {}), (0, {"place_offset.offset": 0.003}), (0, {"place_gain.share": 0.1}),
             (0, {"place_delay.delay": 0.02})]
        )
    )  # fmt: skip
    assert offset == pytest.approx(plain + 0.003, abs=1e-15)
    assert gain == pytest.approx(1.1 * plain, abs=1e-15)
    assert late[times >= 0.02] == pytest.approx(plain[:-2], abs=1e-9)
    assert late[times < 0.02] == pytest.approx(0.02, abs=1e-12)  # held before the release


def test_an_input_may_err_in_size_place_and_time(rig: MjcfRig) -> None:
    """The cart is linear: forced motions add, and a constant force only moves the centre."""
    plain, weak, stronger, late = (
        found[:, 0]
        for found in rig.predict(
            [(0, {}), (0, {"force_gain.share": -0.99}), (0, {"force_gain.share": 0.5}),
             (0, {"force_delay.delay": 0.05})]
        )
    )  # fmt: skip
    forced = (plain - weak) / 0.99
    assert stronger - plain == pytest.approx(0.5 * forced, abs=1e-9)
    assert (late - plain + forced)[5:] == pytest.approx(forced[:-5], abs=1e-6)
    moved = 0.08 / 80
    values = {"force_offset.offset": 0.08, "start rail": 0.02 + moved}
    still, pushed = (found[:, 0] for found in rig.predict([(1, {"start rail": 0.02}), (1, values)]))
    assert pushed == pytest.approx(still + moved, abs=1e-9)


@pytest.mark.parametrize(("between", "middle"), [("line", 0.5), ("held", 0.0), ("curve", 0.44)])
def test_an_input_goes_between_its_samples_as_the_rig_says(
    folder: Path, table: dict[str, NDArray[np.float64]], between: str, middle: float
) -> None:
    """Of a step from 0 to 1 the impulse over the interval before it tells which way it went."""
    stepped = table | {"force": (table["time_s"] > 0.7045).astype(float)}
    write(folder / "run.csv", stepped)
    path = changed(folder, "between: curve", f"between: {between}")
    rig = load_rig(path)
    numbers = {"rail_stiffness": 0.08, "rail_damping.d": -0.495}
    speed = rig.predict([(0, numbers)])[0][:, 1]
    k = 20  # the step is seen at 0.71 s, which is 0.21 s of the simulation
    assert (speed[k + 1] - speed[k]) * 0.5 * RATE == pytest.approx(middle, abs=0.07)


def test_a_start_is_taken_from_the_data_where_it_is_not_told(
    folder: Path, table: dict[str, NDArray[np.float64]]
) -> None:
    path = changed(
        folder, "begins: 0.5 s, start: {rail: 0.02}", "begins: 1.5 s, start: {rail: free}"
    )
    rig = load_rig(path)
    place, speed = rig.own(0)
    assert (place.name, place.unit, speed.unit) == ("start rail", "m", "m/s")
    row = int(np.argmin(np.abs(table["time_s"] - 1.5)))
    assert place.stated == pytest.approx(table["place"][row], abs=1e-4)
    assert speed.stated == pytest.approx(table["speed"][row], abs=0.02)
    true = {"start rail": table["place"][row], "start speed rail": table["speed"][row]}
    predicted = rig.predict([(0, true)])[0][:200, 0]
    assert predicted == pytest.approx(table["place"][row : row + 200], abs=1e-9)
    (held,) = rig.own(1)
    assert held.stated == pytest.approx(0.02, abs=1e-12)


def test_parquet_and_csv_are_the_same_run(
    folder: Path, table: dict[str, NDArray[np.float64]]
) -> None:
    plain = load_rig(folder / "rig.yaml").runs[0]
    pq.write_table(pa.table(dict(table)), folder / "run.parquet")
    same = load_rig(changed(folder, "run.csv", "run.parquet")).runs[0]
    assert np.array_equal(plain.values, same.values)
    assert len(plain.rest) == 50


def test_empty_cells_are_not_seen(folder: Path) -> None:
    path = folder / "run.csv"
    lines = path.read_text().splitlines()
    cells = lines[100].split(",")
    lines[100] = ",".join([cells[0], "", *cells[2:]])
    path.write_text("\n".join(lines) + "\n")
    seen = load_rig(folder / "rig.yaml").runs[0]
    assert np.argwhere(~seen.valid).tolist() == [[49, 0]]


def test_an_extended_rig_is_read_back_from_another_folder(rig: MjcfRig, folder: Path) -> None:
    effects = {
        "rail_cubic_stiffness": {"k3": (4200.0, 35.0)},
        "place_delay": {"delay": (0.01, 0.0)},
    }
    values = {"rail_stiffness": 81.25, "cart_mass": 0.505}
    extended = rig.extend(folder / "out" / "one", values, effects, "april")
    assert extended.source == folder / "out" / "one.yaml"
    named = {"rail_cubic_stiffness.k3": 4200.0, "place_delay.delay": 0.01, **values}
    assert np.array_equal(extended.predict([(0, {})])[0], rig.predict([(0, named)])[0])
    assert [u.stated for u in extended.base] == [81.25, 0.505]
    assert not {"rail_cubic_stiffness", "place_delay"} & {c.name for c in extended.causes}
    assert "standard_errors:\n    k3: 35.0" in extended.source.read_text()
    with pytest.raises(InputError, match=r"one\.yaml: exists; a rig is never changed"):
        rig.extend(folder / "out" / "one", values, effects, "april")


def test_a_release_says_which_base_number_it_is_beyond(rig: MjcfRig) -> None:
    causes = {cause.name: cause for cause in rig.causes}
    assert causes["rail_stiffness"].replaces == ("rail_stiffness",)
    assert causes["cart_mass"].replaces == ("cart_mass",)
    assert causes["rail_damping"].replaces == ()  # not among the parameters
    assert causes["rail_damping"].unknowns[0].low == pytest.approx(-0.99 * 0.5)
    assert causes["rail_cubic_stiffness"].unknowns[0].unit == "N/m^3"
    assert causes["rail_quadratic_damping"].unknowns[0].low == 0.0
    assert causes["place_gain"].group == "sensor"
    assert causes["rail_damping"].confused_with == (
        "rail_coulomb_friction", "rail_quadratic_damping",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("model: cart.xml", "model: carts.xml", r"rig\.yaml:3:1: model: .*carts\.xml is no file"),
        ("place: {joint: rail}", "place: {joint: rial}",
         r"rig\.yaml:8:11: the model has no joint 'rial'; did you mean 'rail'\?; it has rail, l"),
        ("place: {joint: rail}", "place: {joint: loose}",
         r"rig\.yaml:8:11: joint 'loose' is neither hinge nor slide"),
        ("site: mark,", "site: Marke,", r"10:10: the model has no site 'Marke'; did you mean"),
        ("actuator: coil", "actuator: voice", r"12:11: the model has no actuator 'voice'; it has"),
        ("body: cart, field", "body: wagon, field", r"6:6: the model has no body 'wagon'; it has"),
        ("unit: N/m}", "unit: N m/rad}", r"unit: stiffness of rail is in 'N/m', not 'N m/rad'"),
        ("data: run.csv, begins", "data: ran.csv, begins",
         r"rig\.yaml:14:6: data: .*ran\.csv is no file; did you mean 'run\.csv'"),
        ("column: mark_mm", "column: mark_m",
         r"rig\.yaml:14:6: run\.csv has no column 'mark_m'; did you mean 'mark_mm'\?; it has t"),
        ("begins: 0.5 s, start: {rail: 0.02}", "begins: 50 s", r"begins: 50 s is not within 0 and"),
        ("    place: {offset", "    plaice: {offset", r"no channel 'plaice'; did you mean 'place'"),
        ("field: mass", "field: stiffness", r"field stiffness is a joint's; name the joint and no"),
        ("cubic_damping: 3", "cubik_damping: 3", r"'cubik_damping' is not one of|cubik_damping"),
        ("coulomb_friction: 0.05", "coulomb_friction: 0", r"friction: 0 is not .*above 0"),
        ("force: {actuator", "place: {actuator", r"'place' names a channel and an input"),
        ("coulomb_friction: 0.05}", "armature: 0.05}", r"19:66: armature: .* does not know it yet"),
        ("begins: 0.5 s, start: {rail: 0.02}", "begins: 0.5 s, late: 9 ms", r"14:36: late: `diagn"),
        ("effects:\n", "found: [{cause: rail_cubic, parameters: {k3: 1}}]\neffects:\n",
         r"16:10: cause: 'rail_cubic' is none of the rig's effects"),
        ("effects:\n", "found: [{cause: rail_damping, parameters: {k: 1}}]\neffects:\n",
         r"rail_damping has no quantity 'k'; it has d"),
    ],
)  # fmt: skip
def test_a_fault_of_the_rig_file_is_told_where_it_stands(
    folder: Path, old: str, new: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        load_rig(changed(folder, old, new))


def test_a_start_that_no_channel_tells_must_be_a_number(folder: Path) -> None:
    path = changed(folder, "place: {joint: rail}", "place: {site: mark, axis: z}")
    with pytest.raises(FileFaults, match="rail begins 'held', but no channel measures"):
        load_rig(path)


@pytest.mark.parametrize(
    ("line", "cells", "message"),
    [
        (9, "0.07,0,0,0,0", r"run\.csv:10: time 0\.07 s follows 0\.07 s; times must increase"),
        (9, "0.075,0,0,0,0", r"run\.csv:10: a step of 0\.005 s among steps of 0\.01 s; write"),
        (9, ",0,0,0,0", r"run\.csv:10: a sample without a time"),
        (9, "0.08,dark,0,0,0", r"run\.csv:10: place is 'dark'; it must be a number, or nothing wh"),
        (9, "0.08,0,0,0,", r"run\.csv:10: input force is empty; what acted must be known"),
        (9, "0.08,0,0", r"run\.csv: cannot be read as a table: .*Expected 5 columns, got 3"),
    ],
)
def test_data_that_cannot_be_used_are_refused_with_their_line(
    folder: Path, line: int, cells: str, message: str
) -> None:
    path = folder / "run.csv"
    lines = path.read_text().splitlines()
    lines[line] = cells
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=message):
        load_rig(folder / "rig.yaml")


def test_a_model_that_mujoco_refuses_is_told_in_its_words(folder: Path) -> None:
    (folder / "cart.xml").write_text(MODEL.replace('mass="0.5"', 'mass="heavy"'))
    with pytest.raises(InputError, match=r"cart\.xml: MuJoCo refuses it: .*'mass'\s+Element"):
        load_rig(folder / "rig.yaml")


def made() -> ModuleType:
    """The script that made the examples' data."""
    spec = importlib.util.spec_from_file_location("make_data", EXAMPLES / "make_data.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["make_data"] = module
    spec.loader.exec_module(module)
    return module


def whitened_size(rig: MjcfRig, values: dict[str, float]) -> list[float]:
    """Root mean square of measured less predicted over the noise at rest, by run."""
    sizes = []
    predictions = rig.predict([(k, values) for k in range(len(rig.runs))])
    for seen, predicted in zip(rig.runs, predictions, strict=True):
        noise = np.nanstd(seen.rest, axis=0)
        sizes.append(float(np.sqrt(np.mean(((seen.values - predicted) / noise) ** 2))))
    return sizes


def test_the_spring_s_true_causes_leave_nothing_but_noise() -> None:
    rig, truth = load_rig(EXAMPLES / "hardening_spring" / "rig.yaml"), made().CART
    true = {"rail_cubic_stiffness.k3": truth.cubic, "place_delay.delay": truth.delay}
    assert max(whitened_size(rig, {})) > 5
    assert max(whitened_size(rig, true)) < 1.2


def test_the_pendulum_s_true_cause_predicts_its_own_equation() -> None:
    make, rig = made(), load_rig(EXAMPLES / "pendulum" / "rig.yaml")
    for k, angle in enumerate((0.2, 0.5, 0.9, 0.7)):
        true = make.pendulum_run(make.PENDULUM, angle, rig.runs[k].times)
        values = {"pivot_coulomb_friction.friction": make.PENDULUM.friction, "start pivot": angle}
        predicted, base = rig.predict([(k, values), (k, {"start pivot": angle})])
        assert np.abs(predicted[:, 0] - true).max() < make.PENDULUM.noise
        assert np.abs(base[:, 0] - true).max() > 100 * make.PENDULUM.noise


def test_the_examples_data_are_what_the_script_makes(tmp_path: Path) -> None:
    for name in ("pendulum", "hardening_spring"):
        (tmp_path / name).mkdir()
    made().main(tmp_path)
    for path in sorted(tmp_path.rglob("*.csv")):
        committed = EXAMPLES / path.relative_to(tmp_path)
        fresh = np.loadtxt(path, delimiter=",", skiprows=1)
        kept = np.loadtxt(committed, delimiter=",", skiprows=1)
        last_digit = 0.0201 if "hardening" in str(path) else 8e-4
        assert np.abs(fresh - kept).max() <= last_digit  # solvers differ in the last digit


def test_every_number_and_cause_of_the_examples_moves_the_prediction() -> None:
    for name in ("pendulum", "hardening_spring"):
        rig = load_rig(EXAMPLES / name / "rig.yaml")
        problem = Problem(rig, Layout(rig), noise_of(rig.runs), [0, 1])
        near = problem.linear(np.zeros(len(problem.layout)), problem.layout.shared, until=3.0)
        moved = np.sum([np.sum(j**2, axis=0) for j in near.jacobians], axis=0)
        assert (moved[problem.layout.shared] > 0).all()
