"""A run from the first click to its verdict, in a real browser on the practice bench."""

from __future__ import annotations

import http.client
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from tests.bundles import NOW, asked_for, journal_of, manifest_of, note
from tests.panel.chromium import Browser, Page
from tests.panel.conftest import PRACTICE
from tests.panel.test_panel_browser import has
from workbench.bundle import Bundle, bundle_names
from workbench.loopback import HERE
from workbench.panel import Panel

pytestmark = [
    pytest.mark.xdist_group("alone"),
    pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals"),
]
STARTS_S = 60.0
PROTOCOL = """\
schema: workbench/protocol-1
title: A hop from the panel
steps:
  - prompt: Stand the robot on the start line.
  - run: {mode: hop, speed: 17 rad/s, rest: 0.5 s, ramp: 0.2 s, duration: 3 s,
      expect: {distance: 0 mm to 200 mm, twin_error: below 500 mm}}
"""


@pytest.fixture
def protocol(tmp_path: Path) -> Path:
    folder = tmp_path / "protocols"
    folder.mkdir()
    path = folder / "hop.yaml"
    path.write_text(PROTOCOL)
    (folder / "broken.yaml").write_text(PROTOCOL.replace("speed", "sped"))
    return path


@pytest.fixture
def page(browser: Browser, panel: Panel, protocol: Path) -> Iterator[Page]:
    opened = browser.open(panel.url)
    yield opened
    assert opened.complaints() == []
    assert all(url.startswith(panel.url) for url in opened.requests())
    opened.close()


def rehearse(page: Page) -> None:
    """Pick the protocol and wait for its dry run."""
    if page.sees("#start-another"):
        click(page, "#start-another")
    page.wait_for("document.querySelector('[data-name=\"hop.yaml\"]') !== null", STARTS_S)
    click(page, '[data-name="hop.yaml"]')
    page.wait_for("!document.querySelector('#plan-shown').hidden", STARTS_S)


def click(page: Page, selector: str) -> float:
    script = f"document.querySelector('{selector}').scrollIntoView({{block: 'center'}})"
    page.evaluate(script)  # from under the bar of STOP
    return page.click(selector)


def confirm(page: Page, operator: str) -> None:
    page.evaluate("at('operator').value = ''")
    click(page, "#operator")
    page.type(operator)
    click(page, "#confirm-start")
    page.wait_for("!document.querySelector('#prompt').hidden", STARTS_S)
    assert page.text("#prompt-text") == "Stand the robot on the start line."


def newest(tmp_path: Path) -> Bundle:
    return Bundle.open(tmp_path / "runs" / bundle_names(tmp_path / "runs")[-1])


def stop_while_driving(page: Page, tmp_path: Path) -> None:
    """Answer the prompt, press STOP once the output is on, and see that it is off."""
    click(page, "#prompt-send")
    page.wait_for("document.querySelector('#output').className === 'value live'", STARTS_S)
    page.click("#stop")
    page.wait_for(has("#banner-title", "Stopped by the user"), STARTS_S)
    assert page.text("#output") == "off, confirmed"
    facts = manifest_of(newest(tmp_path))
    assert (facts["status"], facts["output_off"]) == ("interrupted", "confirmed")


def test_a_run_is_picked_rehearsed_confirmed_answered_and_stopped(
    tmp_path: Path, page: Page
) -> None:
    page.wait_for("document.querySelector('#protocols button') !== null", STARTS_S)
    again = "const one = document.querySelector('#protocols button'); await listProtocols()"
    assert page.evaluate(f"(async () => {{ {again}; return one.isConnected; }})()")
    rehearse(page)
    assert page.text("#plan-title") == "A hop from the panel"
    assert "1 run, about 4 s on the bench; 1 prompt, not counted" in page.text("#plan-facts")
    assert "before run 1: Stand the robot on the start line." in page.text("#plan-operator")
    assert "distance 0.000 to 0.200 m" in page.text("#plan-runs")
    lost = "[isLive].forEach((live) => { isLive = () => false; showStart(); isLive = live; })"
    page.evaluate(f"{lost}; showStart()")
    page.wait_for("document.querySelector('#confirm-start').offsetParent !== null")  # as before
    click(page, "#confirm-start")
    assert page.text("#start-refused") == "Type the operator's name first."
    page.type("Anna Berg")
    page.key("Enter", 13, "\r")  # starts no motor
    page.evaluate("at('confirm-start').click()")  # neither does a script
    assert not any(url.endswith("/start") for url in page.requests())
    assert page.sees("#confirm-start")
    confirm(page, "Anna Berg")
    assert not page.sees("#start")
    assert not page.sees("#prompt-where")  # it has no terminal
    assert "Anna Berg" in page.text("#place")
    stop_while_driving(page, tmp_path)
    asked = journal_of(newest(tmp_path))[0]
    assert (asked["operator"], asked["where"]) == ("Anna Berg", "panel")
    assert manifest_of(newest(tmp_path))["operator"] == "Anna Berg"
    page.ask("Page.reload")
    page.wait_for("document.readyState === 'complete'")
    page.wait_for("document.querySelector('#start-another').offsetParent !== null")
    assert not page.sees("#plan")  # loading the page again begins at the list
    assert len(bundle_names(tmp_path / "runs")) == 1


@pytest.mark.long
def test_a_run_is_followed_to_its_verdict_and_the_next_is_stopped(
    tmp_path: Path, page: Page, protocol: Path
) -> None:
    page.wait_for(has("#protocols", "unknown key 'sped'"), STARTS_S)
    rehearse(page)
    confirm(page, "Anna Berg")
    click(page, "#prompt-send")
    page.wait_for("now().run > 1", STARTS_S)
    page.wait_for(has("#banner-title", "Complete: pass"), STARTS_S)
    page.wait_for("!document.querySelector('#result-report').hidden")
    assert page.text("#verdict") == "pass: as expected"
    assert page.evaluate("document.querySelector('#verdict').className") == "verdict pass"
    assert "expected 0.000 to 0.200 m" in page.text("#judged")
    for link in ("#result-report", "#result-recording"):
        size = page.evaluate(
            f"fetch(document.querySelector('{link}').href).then((found) => found.ok &&"
            " found.blob()).then((found) => found.size)"
        )
        assert size > 1000, link
    page.wait_for(has("#runs", "pass"))

    page.resize(420, 900)
    rehearse(page)
    protocol.write_text(f"{PROTOCOL}# another word\n")
    page.evaluate("at('operator').value = ''")
    click(page, "#operator")
    page.type("Ben")
    click(page, "#confirm-start")
    page.wait_for(has("#banner-title", "Not started"), STARTS_S)
    assert "changed since the dry run that was confirmed; nothing was started" in page.text(
        "#banner"
    )
    assert page.evaluate("document.documentElement.scrollWidth") <= 420
    rehearse(page)
    confirm(page, "Ben")
    stop_while_driving(page, tmp_path)
    assert len(bundle_names(tmp_path / "runs")) == 2


def test_a_run_that_is_not_as_expected_is_shown_in_words_and_colour(
    tmp_path: Path, browser: Browser, panel: Panel
) -> None:
    page = browser.open(panel.url)
    for name, highest in (("one", 0.2), ("two", 0.05)):
        expect = {"distance_m": (0.01, highest)}
        bundle = Bundle.create(tmp_path / "runs", name, NOW, asked_for(expect=expect))
        note(bundle, real={"distance_m": 0.1}, twin={"distance_m": 0.12}, error_mm=3.0)
        bundle.finish("complete")
    for word in ("FAIL", "pass"):  # the list may be read between the two bundles
        page.wait_for(has("#runs", word))
    marks = page.evaluate(
        "[...document.querySelectorAll('#runs td:nth-child(7)')]"
        ".map((cell) => cell.innerText + cell.className)"
    )
    assert sorted(marks) == ["FAILbad", "passpass"]
    page.close()


CLI = [sys.executable, "-c", "from workbench.cli import main; main()"]


def start_by_hand(tmp_path: Path, terminal: int) -> tuple[subprocess.Popen[str], int]:
    """Start a panel as a command and a run from it; return it when the output is on."""
    words = ["panel", "protocols", "--bench", str(PRACTICE), "--runs", "runs", "--json"]
    panel = subprocess.Popen(
        [*CLI, *words], stdout=subprocess.PIPE, stderr=terminal, text=True, cwd=tmp_path
    )
    assert panel.stdout is not None
    url = json.loads("".join(iter(panel.stdout.readline, "}\n")) + "}")["url"]

    def post(path: str, what: dict[str, Any]) -> Any:
        link = http.client.HTTPConnection(HERE, int(url.split(":")[2].split("/")[0]), timeout=60)
        origin = url.rpartition("/")[0].rpartition("/")[0]
        headers = {"origin": origin, "content-type": "application/json"}
        link.request("POST", f"/{url.split('/')[3]}/{path}", json.dumps(what), headers)
        with closing(link):
            return json.loads(link.getresponse().read())

    token = post("dry-run", {"name": "hop.yaml"})["token"]
    assert post("start", {"token": token, "operator": "Anna"})["started"]
    return panel, wait_until_on(tmp_path)


def wait_until_on(tmp_path: Path) -> int:
    """Wait until the output of the newest run is on, and return the process of the run."""
    deadline = time.monotonic() + STARTS_S
    while time.monotonic() < deadline:
        time.sleep(0.05)
        cards = list((tmp_path / "runs.live").glob("*.json"))
        names = bundle_names(tmp_path / "runs") if cards else []
        # the card may come before the manifest
        found = names and (tmp_path / "runs" / names[-1] / "manifest.json").exists()
        if found and any(event["event"] == "output_on" for event in journal_of(newest(tmp_path))):
            return int(json.loads(cards[0].read_text())["pid"])
    raise AssertionError("the output did not go on")


@pytest.mark.long
@pytest.mark.parametrize("how", ["SIGINT", "SIGTERM", "SIGHUP", "SIGKILL"])
def test_what_becomes_of_a_run_when_its_panel_ends(
    tmp_path: Path, protocol: Path, how: str
) -> None:
    protocol.write_text(PROTOCOL.replace("  - prompt: Stand the robot on the start line.\n", ""))
    keyboard, terminal = os.openpty()
    panel, run = start_by_hand(tmp_path, terminal)
    os.close(terminal)
    os.close(keyboard)  # nothing can be written to it any more
    panel.send_signal(getattr(signal, how))
    panel.communicate(timeout=STARTS_S)
    deadline = time.monotonic() + STARTS_S
    while (bundle := newest(tmp_path)) and not bundle.is_closed():
        assert time.monotonic() < deadline
        time.sleep(0.1)
    facts = manifest_of(bundle)
    assert facts["output_off"] == "confirmed"
    # closed, it stops what it started; killed, it cannot, and the run goes on to its end
    assert facts["status"] == ("complete" if how == "SIGKILL" else "interrupted")
    while Path(f"/proc/{run}").exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    assert os.listdir(tmp_path / "runs.live") == []
