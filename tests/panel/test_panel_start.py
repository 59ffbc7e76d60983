"""Starting a run from the page: what may be started, by whom, once, and what became of it."""

from __future__ import annotations

import http.client
import json
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import Command
from tests.panel.conftest import PRACTICE
from workbench.bundle import events, sentence
from workbench.loopback import HERE
from workbench.panel import Panel, Protocols, Starter
from workbench.run import START, VARIABLE
from workbench.run.control import claim
from workbench.run.started_by import started

HOP = """\
schema: workbench/protocol-1
title: One hop
steps:
  - prompt: Stand the robot on the start line.
  - run: {mode: hop, speed: 17 rad/s, rest: 1 s, ramp: 0.5 s, duration: 3 s, repeats: 2}
"""
# stands in for `workbench run`; what it does is the last line of the protocol
COMMAND = """\
import json, os, sys, time
from pathlib import Path
words, protocol = sys.argv[1:], Path(sys.argv[-1])
with (protocol.parent / "calls.jsonl").open("a") as file:
    names = ("WORKBENCH_OPERATOR", "WORKBENCH_PANEL_START")
    print(json.dumps([words, [os.environ.get(name) for name in names]]), file=file)
does = protocol.read_text().splitlines()[-1]
if "--dry-run" in words:
    run = {"number": 1, "instants": []}
    print(json.dumps({"title": "One hop", "plan_id": "a1", "runs": [run]}))
    print("warning: look at the clamp", file=sys.stderr)
    sys.exit("# no rehearsal" in does)
if "# hangs" in does:
    time.sleep(60)
if "# fails" in does:
    sys.exit("workbench: /dev/ttyUSB9 not reachable: there is no such port")
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "protocols"
    made.mkdir()
    (made / "hop.yaml").write_text(HOP)
    return made


@pytest.fixture
def starter(tmp_path: Path, folder: Path) -> Iterator[Starter]:
    """With a command that only notes how it was called."""
    command = (sys.executable, "-c", COMMAND)
    made = Starter(Protocols(folder, str(PRACTICE)), tmp_path / "runs", command)
    yield made
    made.close()


def calls(folder: Path) -> list[Any]:
    """Return how the command was called: words, and operator and start in its environment."""
    file = folder / "calls.jsonl"
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def post(panel: Panel, path: str, what: dict[str, Any], origin: str | None = None) -> Any:
    """Send what the page would, or the page of another site."""
    link = http.client.HTTPConnection(HERE, panel.port, timeout=20)
    own = f"http://{HERE}:{panel.port}"
    headers = {"content-type": "application/json", "origin": own if origin is None else origin}
    link.request("POST", f"/{panel.url.split('/')[3]}/{path}", json.dumps(what), headers)
    reply = link.getresponse()
    text = reply.read().decode()
    link.close()
    return json.loads(text) if reply.status == 200 else (reply.status, text)


def get(panel: Panel, path: str) -> tuple[int, str]:
    link = http.client.HTTPConnection(HERE, panel.port, timeout=20)
    link.request("GET", f"/{panel.url.split('/')[3]}/{path}")
    reply = link.getresponse()
    found = reply.status, reply.read().decode()
    link.close()
    return found


def ended(starter: Starter) -> dict[str, str] | None:
    """Return what is shown once the command has ended."""
    deadline = time.monotonic() + 20
    while starter.alive:
        assert time.monotonic() < deadline
        time.sleep(0.02)
    return starter.facts_of({})


def test_protocols_are_listed_with_their_plan_or_their_fault(folder: Path, panel: Panel) -> None:
    (folder / "broken.yaml").write_text(HOP.replace("speed", "sped"))
    (folder / "lab.yaml").write_text(PRACTICE.read_text())  # a bench is no protocol
    (folder / "notes.txt").write_text("no")
    (folder / "parts").mkdir()
    (folder / "parts" / "inner.yaml").write_text(HOP)
    code, text = get(panel, "protocols.json")
    found = json.loads(text)
    assert code == 200
    assert (found["bench"], found["supply"], found["error"]) == ("practice", "RD6006", "")
    good, bad = found["rows"]
    assert good == {
        "name": "hop.yaml", "title": "One hop", "error": "", "modes": ["hop"], "runs": 2,
        "seconds": 8.0, "prompts": 1,
    }  # fmt: skip
    assert bad["name"] == "broken.yaml"
    assert (
        f"{folder / 'broken.yaml'}:5:22: unknown key 'sped'; did you mean 'speed'?" in bad["error"]
    )
    assert calls(folder) == []  # looking starts nothing


def test_a_folder_or_a_bench_that_is_missing_is_said(tmp_path: Path, folder: Path) -> None:
    assert "no such folder" in Protocols(tmp_path / "none", "virtual").rows()["error"]
    assert "no bench named 'virtul'" in Protocols(folder, "virtul").rows()["error"]


@pytest.mark.parametrize(
    "name",
    ["", ".", "..", "../hop.yaml", "../protocols/hop.yaml", "/etc/passwd", "parts/inner.yaml",
     "hop", "hop.yaml\0", "..\\hop.yaml", "link.yaml"],
)  # fmt: skip
def test_only_names_that_are_listed_are_taken(
    tmp_path: Path, folder: Path, panel: Panel, name: str
) -> None:
    (folder / "parts").mkdir()
    (folder / "parts" / "inner.yaml").write_text(HOP)
    (tmp_path / "hop.yaml").write_text(HOP)
    if sys.platform != "win32":
        (folder / "link.yaml").symlink_to(tmp_path / "hop.yaml")
        (row,) = (
            r for r in Protocols(folder, "virtual").rows()["rows"] if r["name"] == "link.yaml"
        )
        assert "is a link; only files of the folder are served" in row["error"]
    found = post(panel, "dry-run", {"name": name})
    assert found["token"] is None
    assert found["text"] == f"No protocol {name!r} in {folder}."
    assert calls(folder) == []


@pytest.mark.parametrize("path", ["dry-run", "start"])
def test_neither_a_page_of_another_site_nor_a_look_starts_anything(
    folder: Path, panel: Panel, starter: Starter, path: str
) -> None:
    token = starter.dry_run("hop.yaml")["token"]
    what = {"name": "hop.yaml", "token": token, "operator": "Anna"}
    for origin in ("http://evil.example", "null", ""):
        code, text = post(panel, path, what, origin)
        assert (code, "only the panel's own page" in text) == (403, True)
    assert get(panel, f"{path}?name=hop.yaml&token={token}&operator=Anna")[0] == 404
    assert len(calls(folder)) == 1  # the dry run above


def test_a_confirmation_holds_for_one_start(folder: Path, panel: Panel, starter: Starter) -> None:
    shown = post(panel, "dry-run", {"name": "hop.yaml"})
    assert shown["plan"] == {"title": "One hop", "plan_id": "a1", "runs": [{"number": 1}]}
    assert shown["text"] == "warning: look at the clamp"
    confirmed = {"token": shown["token"], "operator": "  Anna   Berg "}
    for name in ("", "   ", "x" * 81, "An\tna\x07"):
        found = post(panel, "start", confirmed | {"operator": name})
        assert not found["started"]
        assert found["text"].startswith("Type the operator's name, 1 to 80 characters")
    assert post(panel, "start", confirmed) == {"started": True, "text": ""}
    assert ended(starter) is None
    for token in (shown["token"], "made up"):
        found = post(panel, "start", confirmed | {"token": token})
        assert not found["started"]
        assert "nothing was started. Look at the dry run again." in found["text"]
    rehearsed, (words, (operator, start)) = calls(folder)
    assert rehearsed[0][:2] == ["--dry-run", "--json"]
    assert rehearsed[1] == [os.environ.get(VARIABLE), None]
    runs = str(folder.parent / "runs")
    bench = ["--bench", str(PRACTICE), "--runs", runs, "--", str(folder / "hop.yaml")]
    assert words == ["--plan-id", "a1", *bench]
    assert (operator, len(start)) == ("Anna Berg", 16)


def test_one_run_at_a_time_and_it_says_whose(
    tmp_path: Path, folder: Path, panel: Panel, starter: Starter
) -> None:
    confirmed = {"token": starter.dry_run("hop.yaml")["token"], "operator": "Anna"}
    facts = {"title": "Long sweep", "bench": "lab", "operator": "Ben"}
    with claim(tmp_path / "runs", "x", facts):
        for path, what in (("start", confirmed), ("dry-run", {"name": "hop.yaml"})):
            assert post(panel, path, what)["text"] == (
                f"“Long sweep” is under way on bench lab, process {os.getpid()}, started by Ben; "
                "wait for its end, or press STOP."
            )
    (folder / "hop.yaml").write_text(f"{HOP}# hangs")
    another = {"token": starter.dry_run("hop.yaml")["token"], "operator": "Cy"}
    assert post(panel, "start", confirmed)["started"]  # the refusal did not use it up
    found = post(panel, "start", another)
    assert found["text"] == "“One hop” is being started by Anna."
    assert len([one for one in calls(folder) if "--plan-id" in one[0]]) <= 1


def test_stop_ends_a_run_that_has_no_session_yet(
    folder: Path, panel: Panel, starter: Starter
) -> None:
    (folder / "hop.yaml").write_text(f"{HOP}# hangs")
    starter.start(starter.dry_run("hop.yaml")["token"], "Anna")
    starting = {"level": "plain", "title": "Starting", "text": "“One hop”, started by Anna."}
    assert starter.facts_of({"start": "another"}) == starting
    assert post(panel, "stop", {})["text"] == "Stopping: One hop, which had not begun."
    found = ended(starter)
    assert found is not None
    assert found["title"] == "Stopped"
    assert "was stopped before it began; nothing was driven" in found["text"]


def test_what_keeps_a_run_from_starting_is_shown_until_the_next(
    folder: Path, starter: Starter
) -> None:
    (folder / "hop.yaml").write_text(f"{HOP}# fails")
    starter.start(starter.dry_run("hop.yaml")["token"], "Anna")
    found = ended(starter)
    assert found is not None
    assert (found["level"], found["title"]) == ("bad", "Not started")
    assert found["text"].endswith(":\n/dev/ttyUSB9 not reachable: there is no such port")
    assert starter.facts_of({}) == found
    (folder / "hop.yaml").write_text(HOP)
    starter.start(starter.dry_run("hop.yaml")["token"], "Anna")
    assert ended(starter) is None


def test_a_dry_run_that_fails_confirms_nothing(folder: Path, starter: Starter) -> None:
    (folder / "hop.yaml").write_text(f"{HOP}# no rehearsal")
    found = starter.dry_run("hop.yaml")
    assert found == {"plan": None, "token": None, "text": "warning: look at the clamp"}


def test_a_panel_that_is_closed_takes_its_run_along(folder: Path, starter: Starter) -> None:
    (folder / "hop.yaml").write_text(f"{HOP}# hangs")
    starter.start(starter.dry_run("hop.yaml")["token"], "Anna")
    assert starter.alive
    starter.close()
    assert not starter.alive


@pytest.mark.parametrize("changed", ["hop.yaml", "lab.yaml"])
def test_what_changed_since_the_dry_run_is_refused(
    folder: Path, tmp_path: Path, workbench: Command, changed: str
) -> None:
    bench = tmp_path / "lab.yaml"
    bench.write_text(PRACTICE.read_text())
    words = ["run", str(folder / "hop.yaml"), "--bench", str(bench), "--dry-run", "--json"]
    plan = workbench(*words).json
    assert plan["operator"] == ["before run 1: Stand the robot on the start line."]
    assert workbench(*words, "--plan-id", plan["plan_id"]).code == 0
    with (folder if changed == "hop.yaml" else tmp_path).joinpath(changed).open("a") as file:
        file.write("# a word more\n")
    answer = workbench(*words, "--plan-id", plan["plan_id"])
    assert answer.code == 2
    assert "changed since the dry run that was confirmed; nothing was started" in answer.err


def test_a_journal_says_who_started_a_run_and_where(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "Anna")
    asked = events.RunAsked(run="hop", rest_s=2, **started())
    assert sentence(asked) == "asked for hop: 2.0 s rest; started by Anna at the terminal"
    monkeypatch.setenv(START, "a1")
    asked = events.RunAsked(run="hop", rest_s=2, **started())
    assert sentence(asked) == "asked for hop: 2.0 s rest; started by Anna in the panel"
    assert (
        sentence(events.RunAsked(run="hop", rest_s=2)) == "asked for hop: 2.0 s rest"
    )  # of before
