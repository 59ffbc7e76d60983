import time
from decimal import Decimal
from pathlib import Path

import pytest

from workbench.errors import FileFaults, InputError
from workbench.run import load_bench
from workbench.schemas import (
    Calibration,
    Plan,
    PlannedDrive,
    PlannedPrompt,
    PlannedRelease,
    Protocol,
    load,
    make_plan,
)

STEP = Decimal("0.01")


def plan_of(folder: Path, steps: str, head: str = "") -> Plan:
    path = folder / "p.yaml"
    path.write_text(f"schema: workbench/protocol-1\ntitle: T\n{head}steps:\n{steps}")
    return make_plan(load(path, Protocol), load_bench("virtual").content, STEP)


def drives(plan: Plan) -> list[PlannedDrive]:
    return [run.action for run in plan.runs if isinstance(run.action, PlannedDrive)]


@pytest.mark.parametrize(
    ("speed", "volts"),
    [(8.2, "2.52"), (10.4, "3.02"), (12.5, "3.50"), (16, "4.30"), (17, "4.52"), (18, "4.75"),
     (19, "4.98"), (19.9, "5.18"), (20, "5.20"), (21, "5.43")],
)  # fmt: skip
def test_speeds_of_the_thesis_become_its_voltages(tmp_path: Path, speed: float, volts: str) -> None:
    (drive,) = drives(plan_of(tmp_path, f"  - run: {{mode: hop, speed: {speed} rad/s}}\n"))
    assert drive.voltage == Decimal(volts)
    assert drive.speed == pytest.approx(4.4 * float(volts) - 2.9)


def test_a_speed_beyond_the_calibration_is_refused_and_not_extrapolated(tmp_path: Path) -> None:
    steps = "  - sweep: {mode: hop, speeds: [17 rad/s, 22 rad/s, 1 rad/s]}\n"
    with pytest.raises(FileFaults) as caught:
        plan_of(tmp_path, steps)
    first, second = caught.value.faults
    assert (first.line, first.column) == (4, 43)
    assert first.text == (
        "22 rad/s needs 5.659 V, which is outside the range of calibration 'thesis-5.7': "
        "1 V to 5.5 V, that is 1.50 rad/s to 21.30 rad/s; it is not extrapolated"
    )
    assert second.text.startswith("1 rad/s needs 0.886 V")


def test_limits_of_the_protocol_and_the_bench_hold(tmp_path: Path) -> None:
    with pytest.raises(FileFaults, match=r"4\.52 V is above the limit of this protocol, 4 V"):
        plan_of(tmp_path, "  - run: {mode: hop, speed: 17 rad/s}\n", "limits: {voltage: 4 V}\n")
    with pytest.raises(
        FileFaults, match=r"current 3 A is above the limit of bench 'virtual', 1\.5 A"
    ):
        plan_of(tmp_path, "  - run: {mode: hop, speed: 17 rad/s}\n", "limits: {current: 3 A}\n")


def test_a_decay_is_a_release_that_tells_the_operator_what_to_do(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "  - run: {mode: decay, pull: 390 mN, rest: 1 s, repeats: 3}\n")
    assert [(run.name, run.repeat, run.rest) for run in plan.runs] == [
        ("decay-0.39N", repeat, 1.0) for repeat in (1, 2, 3)
    ]
    release = plan.runs[0].action
    assert isinstance(release, PlannedRelease)
    assert (release.pull, release.height) == (0.39, None)
    assert "Pull T forward with 0.39 N" in release.ready
    assert "a weight of 40 g" in release.ready  # 0.39 N / 9.81 m/s^2
    assert release.now == "Burn or cut the thread now, then confirm."


def test_a_drop_is_a_release_from_a_height(tmp_path: Path) -> None:
    (run,) = plan_of(tmp_path, "  - run: {mode: drop, height: 2 cm}\n").runs
    assert isinstance(run.action, PlannedRelease)
    assert (run.name, run.action.pull, run.action.height) == ("drop-20mm", None, 0.02)
    assert "20 mm above the floor" in run.action.ready


def test_the_ramp_rises_in_even_steps_from_the_lowest_voltage(tmp_path: Path) -> None:
    (drive,) = drives(plan_of(tmp_path, "  - run: {mode: hop, voltage: 4.5 V, ramp: 0.5 s}\n"))
    assert [f"{t:.1f} {v}" for t, v in drive.steps] == [
        "0.0 1.00", "0.1 1.70", "0.2 2.40", "0.3 3.10", "0.4 3.80", "0.5 4.50",
    ]  # fmt: skip


def test_the_slew_of_the_bench_lengthens_a_ramp_that_is_too_fast(tmp_path: Path) -> None:
    (drive,) = drives(plan_of(tmp_path, "  - run: {mode: hop, voltage: 5 V, ramp: 0 s}\n"))
    assert drive.ramp == pytest.approx(4 / 20)


def test_a_ramp_longer_than_the_drive_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileFaults, match="ramp 5 s is not shorter than duration 3 s"):
        plan_of(tmp_path, "  - run: {mode: hop, voltage: 4 V, ramp: 5 s, duration: 3 s}\n")


def test_a_random_order_is_the_seed_s_and_keeps_every_run(tmp_path: Path) -> None:
    steps = (
        "  - prompt: go\n"
        "  - sweep: {mode: hop, voltages: [2 V, 3 V, 4 V, 5 V], repeats: 3,"
        " order: random, seed: 4}\n"
    )
    plan = plan_of(tmp_path, steps)
    order = [(d.voltage, run.repeat) for d, run in zip(drives(plan), plan.runs, strict=True)]
    again = plan_of(tmp_path, steps)
    assert order == [(d.voltage, r.repeat) for d, r in zip(drives(again), again.runs, strict=True)]
    assert sorted(order) == [(Decimal(v), r) for v in "2345" for r in (1, 2, 3)]
    assert order != sorted(order)
    assert [run.number for run in plan.runs] == list(range(1, 13))
    assert isinstance(plan.items[0], PlannedPrompt)
    assert plan.seconds == pytest.approx(12 * 12)


def test_the_calibration_inverts_itself_and_refuses_outside() -> None:
    line = Calibration()
    assert line.speed(line.voltage(17)) == pytest.approx(17)
    assert line.speed(0) == 0
    with pytest.raises(InputError, match=r"0.7 V is outside the range of calibration 'thesis'"):
        line.speed(0.7)


def test_a_range_is_written_once_and_holds_both_ends(tmp_path: Path) -> None:
    up = "  - sweep: {mode: hop, speeds: {from: 16 rad/s, to: 21 rad/s, step: 1 rad/s}}\n"
    down = "  - sweep: {mode: hop, voltages: {from: 5 V, to: 2000 mV, count: 4}}\n"
    plan = plan_of(tmp_path, up + down)
    assert [round(d.speed or 0) for d in drives(plan)[:6]] == [16, 17, 18, 19, 20, 21]
    assert [str(d.voltage) for d in drives(plan)[6:]] == ["5.00", "4.00", "3.00", "2.00"]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("{from: 16 rad/s, to: 21 rad/s, step: 2 rad/s}", "do not lead .* that is 2.5 steps"),
        ("{from: 16 rad/s, to: 21 rad/s}", "needs either step or count"),
        ("{from: 16 rad/s, till: 21 rad/s, count: 3}", "needs 'to'; write for example {from: 16"),
        ("{from: 16, to: 21, count: 3}", "from must be text with a unit, found 16; write"),
        ("{from: 16 rad/s, to: 21 rad/s, count: 1}", "count must be 2 to 1000, found 1"),
        ("{from: 16 rad/s, to: 21 rad/s, step: 0 rad/s}", "0 rad/s is not allowed"),
        ("{from: 20 rad/s, to: 30 rad/s, count: 2}", "30 rad/s needs 7.477 V, which is outside"),
    ],
)
def test_a_range_that_cannot_be_is_told(tmp_path: Path, given: str, words: str) -> None:
    with pytest.raises(FileFaults, match=words):
        plan_of(tmp_path, f"  - sweep: {{mode: hop, speeds: {given}}}\n")


def test_pulls_and_heights_are_swept_like_speeds(tmp_path: Path) -> None:
    steps = (
        "  - sweep: {mode: decay, pulls: [0.2 N, 0.4 N], repeats: 2}\n"
        "  - sweep: {mode: drop, heights: {from: 10 mm, to: 3 cm, count: 3}}\n"
    )
    names = [run.name for run in plan_of(tmp_path, steps).runs]
    decays = ["decay-0.2N", "decay-0.4N"] * 2
    assert names == [*decays, "drop-10mm", "drop-20mm", "drop-30mm"]
    with pytest.raises(FileFaults, match=r"mode decay needs pulls, for example 'pulls: \[0.2 N"):
        plan_of(tmp_path, "  - sweep: {mode: decay}\n")


def test_a_staircase_is_one_run_up_and_down_within_the_slew(tmp_path: Path) -> None:
    steps = (
        "  - staircase: {mode: clamped, voltages: [2 V, 3 V, 5 V], dwell: 4 s, ramp: 0 s,"
        " step_ramp: 0.2 s, down: true}\n"
    )
    (run,) = plan_of(tmp_path, steps).runs
    (drive,) = drives(plan_of(tmp_path, steps))
    assert run.duration == 20
    assert run.name == "clamped-5.90to19.10"
    assert [(level.since, str(level.voltage)) for level in drive.levels] == [
        (0, "2.00"), (4, "3.00"), (8, "5.00"), (12, "3.00"), (16, "2.00"),
    ]  # fmt: skip
    assert (drive.voltage, drive.speed) == (None, None)
    # at 20 V/s the first volt takes 50 ms; a step of 2 V takes the 0.2 s that were asked for
    assert [f"{t:.2f} {v}" for t, v in drive.steps] == [
        "0.00 1.00", "0.05 2.00", "4.10 2.50", "4.20 3.00", "8.10 4.00", "8.20 5.00",
        "12.10 4.00", "12.20 3.00", "16.10 2.50", "16.20 2.00",
    ]  # fmt: skip


def test_prompts_and_pauses_belong_to_the_run_that_follows_or_to_the_last(tmp_path: Path) -> None:
    steps = (
        "  - prompt: first\n"
        "  - run: {mode: hop, voltage: 4 V, before: [still?], after: [{text: how far?,"
        " value: {name: distance, quantity: length}}]}\n"
        "  - pause: 1 min\n"
        "  - prompt: second\n"
        "  - run: {mode: hop, voltage: 5 V}\n"
        "  - prompt: last\n"
    )
    plan = plan_of(tmp_path, steps)
    assert [type(item).__name__ for item in plan.items] == [
        "PlannedPrompt", "PlannedRun", "PlannedPause", "PlannedPrompt", "PlannedRun",
    ]  # fmt: skip
    first, second = plan.runs
    assert [one.text for one in (*first.before, *first.after, *second.after)] == [
        "still?",
        "how far?",
        "last",
    ]
    assert plan.prompts == 5
    assert plan.seconds == 60 + 2 * 12
    left = plan.without({1})
    assert [type(item).__name__ for item in left.items] == [
        "PlannedPause",
        "PlannedPrompt",
        "PlannedRun",
    ]
    assert left.runs == (second,)


def test_limits_and_calibration_that_the_protocol_names_hold(tmp_path: Path) -> None:
    run = "  - run: {mode: hop, speed: 18 rad/s}\n"
    with pytest.raises(FileFaults, match=r"18\.00 rad/s is above the limit of this protocol, 17"):
        plan_of(tmp_path, run, head="limits: {speed: 17 rad/s}\n")
    with pytest.raises(FileFaults, match=r"3:1: bench 'virtual' has calibration 'thesis-5\.7'"):
        plan_of(tmp_path, run, head="calibration: march\n")
    plan_of(tmp_path, run, head="calibration: thesis-5.7\n")


@pytest.mark.parametrize(
    ("steps", "words"),
    [
        ("  - sweep: {mode: hop, voltages: {from: 2 V, to: 4 V, count: 900}, repeats: 1000}\n",
         "4:5: 900000 runs up to here, and a protocol may have at most 2000; use fewer values"),
        ("  - run: {mode: hop, voltage: 4 V, repeats: 1000, duration: 1 h}\n",
         "4:5: 1001 h on the bench up to here, and a protocol may take at most 168 h; use fewer"),
        ("  - run: {mode: hop, voltage: 4 V, repeats: 1000, duration: 1 s}\n" * 3,
         "6:5: 3000 runs up to here"),
        ("  - pause: 24 h\n" * 8, "11:5: 192 h on the bench up to here"),
        ("  - sweep: {mode: decay, pulls: {from: 0.1 N, to: 1 N, count: 3}, repeats: 1000}\n",
         "4:5: 3000 runs"),
        ("  - run: {mode: hop, voltage: 4 V, repeats: 1000, before: [" + "x, " * 60 + "]}\n",
         "4:5: 60001 steps and prompts up to here, and a protocol may have at most 50000"),
        ("  - staircase: {mode: hop, voltages: {from: 2 V, to: 4 V, count: 1000}, dwell: 1 h}\n",
         "4:5: 1001 h on the bench|4:5: 1000 h on the bench"),
        ("  - staircase: {mode: hop, voltages: {from: 2 V, to: 4 V, count: 1000}, dwell: 70 s, "
         "step_ramp: 60 s, down: true}\n",
         "4:5: ramps of 1199400 voltages in one run, and there may be at most 10000; use fewer"),
    ],
)  # fmt: skip
def test_a_plan_that_nobody_can_mean_is_refused_at_once(
    tmp_path: Path, steps: str, words: str
) -> None:
    began = time.process_time()
    with pytest.raises(FileFaults, match=words):
        plan_of(tmp_path, steps)
    assert time.process_time() - began < 1


def test_the_largest_plan_is_laid_out(tmp_path: Path) -> None:
    plan = plan_of(tmp_path, "  - run: {mode: hop, voltage: 4 V, repeats: 1000}\n" * 2)
    assert len(plan.runs) == 2000


def test_limits_of_a_protocol_that_are_looser_than_the_bench_s_are_refused(tmp_path: Path) -> None:
    run = "  - run: {mode: hop, voltage: 4 V}\n"
    with pytest.raises(
        FileFaults, match=r"p\.yaml:3:10: voltage 9 V is above the limit of bench 'virtual', 5\.5 V"
    ):
        plan_of(tmp_path, run, "limits: {voltage: 9 V}\n")
    with pytest.raises(FileFaults, match=r"speed 99 rad/s is above the limit .* 21\.3 rad/s"):
        plan_of(tmp_path, run, "limits: {speed: 99 rad/s}\n")
    plan_of(tmp_path, run, "limits: {voltage: 5.5 V, speed: 21.3 rad/s, current: 1.5 A}\n")


@pytest.mark.parametrize(
    "steps",
    [
        "  - prompt: {text: x, value: {name: a}}\n  - prompt: {text: y, value: {name: a}}\n"
        "  - run: {mode: hop, voltage: 4 V}\n",
        "  - prompt: {text: x, value: {name: a}}\n"
        "  - run: {mode: hop, voltage: 4 V, after: [{text: y, value: {name: a}}]}\n",
        "  - run: {mode: hop, voltage: 4 V, before: [{text: x, value: {name: a}}], "
        "after: [{text: y, value: {name: a}}]}\n",
        "  - run: {mode: hop, voltage: 4 V, after: [{text: y, value: {name: a}}]}\n"
        "  - prompt: {text: x, value: {name: a}}\n",
    ],
)
def test_two_values_of_a_run_have_two_names(tmp_path: Path, steps: str) -> None:
    with pytest.raises(FileFaults, match="name: 'a' is asked for twice at one run") as caught:
        plan_of(tmp_path, steps)
    assert len(caught.value.faults) == 1
    assert "name: a" in caught.value.faults[0].source


def test_each_run_may_ask_for_the_same_value(tmp_path: Path) -> None:
    asked = "after: [{text: y, value: {name: a}}]"
    plan = plan_of(tmp_path, f"  - run: {{mode: hop, voltage: 4 V, repeats: 2, {asked}}}\n" * 2)
    assert len(plan.runs) == 4


ONCE = "  - prompt: Clamp the foot. Wait before {word} run.\n"
RUN = "  - run: {mode: hop, speed: 17 rad/s}\n"


@pytest.mark.parametrize(("steps", "warned"), [
    (ONCE.format(word="each") + 2 * RUN, True),
    (ONCE.format(word="Every") + RUN.replace("}", ", repeats: 2}"), True),
    (ONCE.format(word="each") + RUN, False),
    (RUN + ONCE.format(word="each") + RUN, False),
    (2 * RUN.replace("}", ", before: [Wait before each run.]}"), False),
    (ONCE.format(word="the first") + 2 * RUN, False),
])  # fmt: skip
def test_a_prompt_that_speaks_of_every_run_and_is_asked_once_is_warned_of(
    tmp_path: Path, steps: str, warned: bool
) -> None:
    warnings = plan_of(tmp_path, steps).warnings
    assert len(warnings) == warned
    for text in warnings:
        assert "p.yaml:4:5: this prompt speaks of every run but is asked once; " in text
        assert "`before: [TEXT]`" in text
