"""The dry run: the real engine and driver on a simulated supply."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from workbench.cli import main
from workbench.run import Rehearsed, load_bench, make_bench, read_experiment, rehearse

TEXT = """\
schema: workbench/protocol-1
title: T
limits: {current: 1 A}
steps:
  - pause: 5 min
  - run: {mode: hop, voltage: 2.5 V, rest: 1 s, ramp: 0.1 s, duration: 3 s,
      after: [{text: How far?, value: {name: distance, quantity: length}}]}
  - run: {mode: drop, height: 2 cm, rest: 1 s, duration: 2 s}
"""


def rehearsed(folder: Path, text: str = TEXT) -> tuple[Rehearsed, ...]:
    path = folder / "p.yaml"
    path.write_text(text)
    bench = load_bench("virtual")
    return rehearse(read_experiment(path, bench, make_bench(bench.content).voltage_step))


def test_every_word_that_goes_to_the_supply_is_told_at_its_time(tmp_path: Path) -> None:
    drive, release = rehearsed(tmp_path)
    written = {instant.time: instant.words for instant in drive.instants}
    # RD6006: 10 mV and 1 mA a digit; 82 and 83 trip, 8 and 9 set, 18 switches
    assert written[0.0] == (
        "register 18 = 0",
        "register 82 = 600",
        "register 83 = 1600",
        "register 9 = 1000",
        "register 8 = 0",
    )
    assert written[1.0] == ("register 8 = 100", "register 18 = 1")
    assert written[1.1] == ("register 8 = 250",)
    assert written[4.0][0] == "register 18 = 0"
    told = [text for instant in drive.instants for text in instant.events]
    assert told[-1] == "prompt: How far? (type distance)"
    assert "output on at 1.00 V" in told
    assert drive.busy == pytest.approx(4.0)
    assert not any(instant.words for instant in release.instants)
    assert release.instants[0].events[0] == "this mode has no drive: the supply was not opened"


def test_a_dry_run_prints_one_object_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "p.yaml").write_text(TEXT)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["workbench", "run", "p.yaml", "--dry-run", "--json"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    told = json.loads(capsys.readouterr().out)
    assert told["seconds"] == pytest.approx(300 + 4 + 3 + 1.5)
    assert told["prompts"] == 3
    assert told["current_limit_A"] == 1
    assert told["limits"]["calibration"].startswith("thesis-5.7: omega = 4.4 U -2.9 rad/s, 1 V")
    assert told["runs"][0]["instants"][0]["written"][1] == "register 82 = 600"
    assert [path.name for path in tmp_path.iterdir()] == ["p.yaml"]


def test_a_table_of_everything_is_printed_for_people(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "p.yaml").write_text(TEXT)
    monkeypatch.setenv("COLUMNS", "160")
    monkeypatch.setattr(
        "sys.argv", ["workbench", "run", str(tmp_path / "p.yaml"), "--dry-run", "--registers"]
    )
    with pytest.raises(SystemExit):
        main()
    text = capsys.readouterr().out
    assert "T (runs: 2, about 5 min; prompts, not counted: 3)" in text
    assert "at most 1 A, trips at 1.6 A" in text
    assert "register 8 = 250" in text
    assert "pause" in text


def test_a_run_that_is_repeated_is_rehearsed_once(tmp_path: Path) -> None:
    path = tmp_path / "p.yaml"
    path.write_text(
        "schema: workbench/protocol-1\ntitle: T\nsteps:\n"
        "  - run: {mode: hop, voltage: 4 V, duration: 5 s, repeats: 1000}\n"
    )
    bench = load_bench("virtual")
    asked = read_experiment(path, bench, make_bench(bench.content).voltage_step)
    begun: list[str] = []
    told = rehearse(asked, begun.append)
    assert begun == ["rehearse a run (1 of 1000)"]
    assert [one.run.number for one in told] == list(range(1, 1001))
    assert told[0].instants == told[-1].instants


def test_a_dry_run_tells_runs_and_time_before_it_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "p.yaml").write_text(TEXT)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["workbench", "run", "p.yaml", "--dry-run"])
    monkeypatch.setattr("workbench.cli.dry_run.rehearse", lambda *args: pytest.fail("told first"))
    with pytest.raises(pytest.fail.Exception, match="told first"):
        main()
    told = " ".join(capsys.readouterr().err.split())
    assert "2 runs, about 5 min on the bench without the operator's time; 3 prompts" in told
