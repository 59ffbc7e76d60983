"""A run while its bundle grows, and how long it will take."""

from __future__ import annotations

import math
from datetime import datetime
from pathlib import Path

import pytest

from tests.bundles import NOW, asked_for, note
from workbench.bundle import Bundle, SupplyIdentity, events
from workbench.panel.controller import Controller
from workbench.panel.estimate import remaining_s
from workbench.panel.journal_tail import JournalTail
from workbench.panel.result import experiment_verdict, result
from workbench.panel.view import clocks, view

RUNS = [
    {"number": 1, "seconds": 12.0},
    {"why": "cool", "seconds": 30.0},
    {"number": 2, "seconds": 12.0},
]
READING = {"set_voltage_V": 4.5, "voltage_V": 4.49, "current_A": 0.3, "output": True}

RD6006 = SupplyIdentity(model="RD6006", serial="1", firmware="1.0")


@pytest.fixture
def bundle(tmp_path: Path) -> Bundle:
    facts = {"number": 1, "of": 2, "mode": "hop"}
    return Bundle.create(tmp_path / "runs", "hop", datetime(2026, 3, 12, 16), asked_for(**facts))


def test_each_line_is_read_once_and_a_cut_one_later(bundle: Bundle) -> None:
    following = JournalTail(bundle)
    assert not following.read_on()
    bundle.record.journal(events.CamerasStarted(), 0.0)
    bundle.record.journal(events.OutputOn(volts="1.00"), 2.0)
    bundle.record.journal(events.SupplyReading(**READING), 2.1)
    assert following.read_on()
    assert not following.read_on()
    assert following.output.state == "on"
    assert following.readings.between(0, 9) == {
        "time_s": [2.1],
        "set_V": [4.5],
        "volts": [4.49],
        "amps": [0.3],
    }
    with bundle.record.journal_log.open("a") as file:
        file.write('{"time_s": 3.0, "event": "output_off",')
        file.flush()
        assert not following.read_on()
        file.write(' "confirmed": true}\n')
    assert following.read_on()
    assert following.output.state == "off"
    assert [text for _, text in following.notices] == [
        "cameras record",
        "output on at 1.00 V",
        "output off, confirmed",
    ]
    assert not following.ended
    bundle.record.journal(events.Complete(), 4.0)
    following.read_on()
    assert following.ended
    assert following.run_s == 4.0


def test_times_of_events_never_jump_back(bundle: Bundle) -> None:
    following = JournalTail(bundle)
    bundle.record.journal(events.RunAsked(run="hop"), 0.0)
    bundle.record.journal(events.SupplyPrepared(identity=RD6006), 1.02)
    bundle.record.journal(events.CamerasStarted(), 0.0)  # with which the run's time begins anew
    bundle.record.journal(events.OutputOn(volts="1.00"), 2.0)
    following.read_on()
    assert [time for time, _ in following.notices] == [None, None, 0.0, 2.0]


def test_of_a_process_that_hangs_the_output_is_not_known(bundle: Bundle) -> None:
    following = JournalTail(bundle)
    assert view(Controller("silent"), following)["output"]["text"] == "not on yet"
    bundle.record.journal(events.OutputOn(volts="1.00"), 2.0)
    following.read_on()
    assert view(Controller("alive"), following)["output"] == {"level": "live", "text": "on"}
    told = {"level": "alarm", "text": "MAY BE ON"}
    assert view(Controller("silent"), following)["output"] == told
    assert view(Controller("alive"), None)["output"]["text"] == "not on yet"


def test_a_line_that_a_full_disk_cut_is_passed_over(bundle: Bundle) -> None:
    bundle.record.journal_log.write_text('{"time_s": 1.0, "ev\n')
    bundle.record.journal(events.OutputOff(confirmed=False), 1.0)
    following = JournalTail(bundle)
    assert following.read_on()
    assert following.output.state == "unknown"


@pytest.mark.parametrize(
    ("number", "run_s", "phase", "phase_s", "left"),
    [
        (None, 0.0, "", 0.0, 54.0),
        (1, 0.0, "rest 2 s", 1.0, 54.0),
        (1, 5.0, "drive 10 s", 3.0, 49.0),
        (1, 20.0, "track, twin", 5.0, 42.0),
        (1, math.inf, "cool: 30 s", 10.0, 32.0),
        (1, math.inf, "cool: 30 s", 99.0, 12.0),
        (2, 12.0, "track, twin", 0.0, 0.0),
    ],
)
def test_what_is_left_is_the_plan_without_what_is_done(
    number: int | None, run_s: float, phase: str, phase_s: float, left: float
) -> None:
    assert remaining_s(RUNS, number, run_s, phase, phase_s) == left


def test_a_resumed_experiment_counts_what_is_left_of_it() -> None:
    assert remaining_s(RUNS[1:], None, 0.0, "", 0.0) == 42.0


def test_without_a_run_the_page_says_so(bundle: Bundle) -> None:
    shown = view(Controller(), None)
    assert shown["controller"] == "idle"
    assert shown["banner"] is None
    assert clocks(Controller(), None)["running"] is False


def lost(bundle: Bundle) -> tuple[str, str]:
    """What stands in the banner and beside Output when the process of this run died."""
    following = JournalTail(bundle)
    following.read_on()
    shown = view(Controller("gone"), following)
    assert shown["banner"]["level"] == "alarm"
    return shown["banner"]["text"], shown["output"]["text"]


def test_what_became_of_a_dead_run_s_output_is_what_its_guardian_wrote(bundle: Bundle) -> None:
    bundle.record.journal(events.CamerasStarted(), 0.0)
    assert "It had not touched the supply." in lost(bundle)[0]
    bundle.record.journal(events.OutputOn(volts="1.00"), 2.0)
    assert "No guardian watched its output. OUTPUT MAY BE ON" in lost(bundle)[0]
    assert lost(bundle)[1] == "MAY BE ON"

    def add(*lines: str) -> None:
        with bundle.record.guardian_log.open("a") as file:
            file.writelines(f"{line}\n" for line in lines)

    seen_off = '{"event": "off", "confirmed": true}', '{"event": "terminals", "dead": true}'
    add('{"event": "guarding"}', '{"event": "taken"}', *seen_off)
    assert "Its output was off." in lost(bundle)[0]
    add('{"event": "output_on"}')
    assert "OUTPUT MAY BE ON: its guardian has not confirmed off." in lost(bundle)[0]
    assert lost(bundle)[1] == "MAY BE ON"
    add('{"event": "trip", "reason": "its client is dead"}', '{"event": "off", "confirmed": false}')
    assert "has not confirmed off (its client is dead)" in lost(bundle)[0]
    add(*seen_off)
    assert "read back that it is off (its client is dead)" in lost(bundle)[0]
    assert lost(bundle)[1] == "off, confirmed"


def test_a_supply_that_does_not_answer_is_an_alarm_while_its_run_goes_on(bundle: Bundle) -> None:
    lines = ['{"event": "output_on"}', '{"event": "lost", "cause": "no answer"}']
    bundle.record.guardian_log.write_text("\n".join(lines) + "\n")
    shown = view(Controller("alive"), JournalTail(bundle))
    assert shown["banner"]["title"] == "OUTPUT MAY BE ON"
    assert shown["banner"]["text"].startswith("no answer. Use the switch")
    assert shown["output"] == {"level": "alarm", "text": "MAY BE ON"}


def test_the_live_twin_is_shown_while_its_run_is_heard_of() -> None:
    shown = {"live": {"error_mm": 1.2, "limit_mm": 5.0}}
    assert view(Controller("alive", published=shown), None)["live"] == shown["live"]
    assert view(Controller("gone", published=shown), None)["live"] is None


@pytest.mark.parametrize(
    ("verdict", "level", "title"),
    [
        ((0, 0), "good", "Complete"),
        ((1, 0), "good", "Complete: pass"),
        ((1, 1), "bad", "Complete: FAIL"),
        ((3, 0), "good", "Complete: all 3 runs pass"),
        ((3, 1), "bad", "Complete: 1 of 3 runs FAIL"),
    ],
)
def test_an_experiment_that_ended_has_its_verdict(
    verdict: tuple[int, int], level: str, title: str
) -> None:
    controller = Controller("ended", published={"ended": {"kind": "complete", "text": ""}})
    banner = view(controller, None, verdict)["banner"]
    assert (banner["level"], banner["title"]) == (level, title)


def test_a_result_stands_beside_what_was_expected(tmp_path: Path) -> None:
    expect = {"distance_m": (0.2, None), "hop_height_m": (0.0, 0.03)}
    bundle = Bundle.create(tmp_path / "runs", "hop", NOW, asked_for(expect=expect))
    assert result(bundle) is None
    facts = {"distance_m": 0.1, "hop_height_m": 0.02}
    note(bundle, real=facts, twin=facts | {"distance_m": 0.12}, error_mm=3.0)
    bundle.finish("complete")
    found = result(Bundle.open(bundle.path))
    assert found is not None
    assert found["passed"] is False
    assert found["judged"] == [
        ["FAIL", False, "Distance", "0.100 m", "at least 0.200 m"],
        ["pass", True, "Hop height", "20.0 mm", "0.0 to 30.0 mm"],
    ]
    assert found["rows"][:2] == [
        ["Distance [m]", "0.100", "0.120", "+0.020"],
        ["Hop height [mm]", "20.0", "20.0", "+0.0"],
    ]
    assert (found["error"], found["report"]) == ("3.0 mm", False)
    assert experiment_verdict([Bundle.open(bundle.path)]) == (1, 1)
