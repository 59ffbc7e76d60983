"""The panel as a person uses it, in a real browser beside real runs."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.bundles import journal_of, manifest_of
from tests.hw.guardian_rig import Device, off_after
from tests.killing import PROTOCOL, Client
from tests.panel.chromium import Browser, Page
from workbench.bundle import Bundle
from workbench.hw import SimulatedFault
from workbench.loopback import HERE
from workbench.panel import Panel, Starter, Watcher

pytestmark = [
    pytest.mark.xdist_group("alone"),
    pytest.mark.skipif(sys.platform == "win32", reason="clients are ended by signals"),
]
STOP_BAR_S = 0.5
GONE_BAR_S = 1.0
STALLED = 3
PICTURE = Path(__file__).resolve().parents[2] / "docs" / "pictures" / "template.png"
HELD = """
  // what the server sends waits until it is released
  window.held = [];
  window.release = () => held.splice(0).forEach(([, take]) => take());
  window.EventSource = class extends EventSource {
    addEventListener(name, take) {
      super.addEventListener(name, (event) => held.push([name, () => take(event)]));
    }
  };
"""
MUTED = """
  // what the server sends is lost while `muted` is true, as on a line that is stuck
  window.muted = false;
  window.EventSource = class extends EventSource {
    addEventListener(name, take) {
      super.addEventListener(name, (event) => { if (!window.muted) take(event); });
    }
  };
"""
HEARD = """
  // sounds and messages are counted, not made
  window.tones = 0;
  window.messages = [];
  window.AudioContext = class {
    state = "running"; currentTime = 0; destination = {};
    createOscillator() {
      return { frequency: {}, connect() {}, start() { window.tones += 1; }, stop() {} };
    }
    createGain() {
      return { connect() {}, gain: { setValueAtTime() {}, exponentialRampToValueAtTime() {} } };
    }
  };
  window.Notification = class {
    static permission = "granted";
    constructor(title, { body }) { window.messages.push(body); }
  };
  Object.defineProperty(document, "hidden", { get: () => true });
"""
CHOICE = """\
schema: workbench/protocol-1
title: With a choice
steps:
  - prompt: {text: Which foot?, value: {name: foot, one_of: [rubber, 'bare <b>steel</b>']}}
  - run: {mode: clamped, speed: 17 rad/s, rest: 0.5 s, duration: 1 s}
"""
PROMPTS = """\
schema: workbench/protocol-1
title: With prompts
steps:
  - prompt: {text: Stand the robot on the start line.}
  - prompt:
      text: Measure the room.
      value: {name: room, quantity: temperature, low: 10 degC, high: 35 degC}
  - run: {mode: clamped, speed: 17 rad/s, rest: 0.5 s, duration: 1 s}
"""


@pytest.fixture
def page(browser: Browser, panel: Panel) -> Iterator[Page]:
    opened = browser.open(panel.url)
    yield opened
    assert opened.complaints() == []
    assert all(url.startswith(panel.url) for url in opened.requests())
    opened.close()


def has(selector: str, text: str) -> str:
    """Return an expression: this text is read there."""
    return f"document.querySelector('{selector}').innerText.includes({text!r})"


def ending(bundle: Bundle) -> list[Any]:
    """What a journal says from the end of the drive on, without times."""
    events = journal_of(bundle)
    first = next(k for k, event in enumerate(events) if event["event"] == "output_off")
    return [{k: v for k, v in event.items() if k != "time_s"} for event in events[first:]]


def test_stop_ends_a_run_exactly_as_ctrl_c_does(
    tmp_path: Path, device: Device, page: Page, capsys: pytest.CaptureFixture[str]
) -> None:
    by_hand = Client(tmp_path / "by-hand", device)
    by_hand.heard_until("voltage")
    by_hand.kill("SIGINT")
    code = by_hand.end()

    client = Client(tmp_path, device)
    client.heard_until("voltage")
    page.wait_for(has("#output", "on"))
    pressed = page.click("#stop")
    assert client.end() == code == 130
    latency = off_after(device.history, pressed)
    with capsys.disabled():
        print(f"\nSTOP: from the click to dead terminals {1000 * latency:.0f} ms")
    assert 0 < latency < STOP_BAR_S
    assert ending(client.bundle) == ending(by_hand.bundle)
    for key in ("status", "output_off", "error"):
        assert manifest_of(client.bundle)[key] == manifest_of(by_hand.bundle)[key]
    assert manifest_of(client.bundle)["status"] == "interrupted"
    page.wait_for(has("#banner-title", "Stopped by the user"))
    assert "the output is off, confirmed" in page.text("#banner-text")
    assert page.text("#stop-says") == "", "it stops no more"
    assert page.text("#output") == "off, confirmed"


def test_prompts_are_answered_checked_and_stopped_in_the_page(
    tmp_path: Path, device: Device, page: Page
) -> None:
    shutil.copy(PICTURE, tmp_path / "line.png")
    pictured = PROMPTS.replace("line.}", "line., picture: line.png}")
    client = Client(tmp_path, device, pictured, attended=True)
    page.wait_for(has("#prompt-text", "Stand the robot"))
    assert not page.sees("#prompt-input")
    page.wait_for("document.querySelector('#prompt-picture').naturalWidth > 100")
    page.key("Enter", 13, "\r")  # the button has the focus
    page.wait_for(has("#prompt-text", "[room: temperature in degC or °C from 10 degC to 35 degC]"))
    page.type("99 degC")
    page.key("Enter", 13, "\r")
    page.wait_for("!document.querySelector('#prompt-refused').hidden")
    assert page.text("#prompt-refused") == (
        "not taken: 99 degC is not allowed; it must be at least 10 degC, at most 35 degC"
    )
    page.wait_for("document.querySelector('#prompt-input').value === ''")
    page.type("21.5 degC")
    page.key("Enter", 13, "\r")
    page.wait_for(has("#prompt-text", "Start recording"))
    assert not page.sees("#prompt-refused")
    assert not page.sees("#prompt-picture")
    page.click("#prompt-send")
    client.heard_until("output_on")
    page.wait_for(has("#prompt-text", "give its path"))
    page.click("#stop")  # while a prompt is open
    assert client.end() == 130
    prompts = [event for event in journal_of(client.bundle) if event["event"] == "prompt"]
    assert [(event["answer"], event["where"]) for event in prompts] == [
        ("confirmed", "panel"),
        (21.5, "panel"),
    ]
    assert manifest_of(client.bundle)["answers"]["room"] == {"value": 21.5, "unit": "degC"}
    page.wait_for("document.querySelector('#prompt').hidden")


def test_choices_are_buttons(tmp_path: Path, device: Device, page: Page) -> None:
    client = Client(tmp_path, device, CHOICE, attended=True)
    page.wait_for(has("#prompt-text", "Which foot?"))
    assert not page.sees("#prompt-input")
    assert not page.sees("#prompt-send")
    assert page.text("#prompt-choices button:last-child") == "bare <b>steel</b>"
    page.key("Enter", 13, "\r")  # meant for something else
    page.click("#prompt-choices button:first-child")
    page.wait_for(has("#prompt-text", "Start recording"))
    assert not page.sees("#prompt-choices")
    assert page.sees("#prompt-send")
    page.click("#prompt-send")
    client.heard_until("output_on")
    page.click("#stop")
    client.end()
    assert manifest_of(client.bundle)["answers"]["foot"] == {"value": "rubber", "unit": None}


def test_a_pause_is_asked_for_in_the_page_and_answered_there(
    tmp_path: Path, page: Page, root: Path
) -> None:
    protocol = tmp_path / "p.yaml"
    protocol.write_text(
        "schema: workbench/protocol-1\ntitle: Two runs\nsteps:\n  - run: {mode: clamped, "
        "speed: 17 rad/s, rest: 1 s, ramp: 0.2 s, duration: 1 s, repeats: 2}\n"
    )
    bench = root / "docs" / "examples" / "practice-bench.yaml"
    words = ["run", str(protocol), "--bench", str(bench), "--runs", str(tmp_path / "runs")]
    with subprocess.Popen(
        [sys.executable, "-c", "from workbench.cli import main; main()", *words],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as run:
        page.wait_for("!document.querySelector('#pause').hidden")
        page.click("#pause")
        page.wait_for(has("#pause", "Pauses after this run"))
        page.wait_for(has("#prompt-text", "Paused after run 1 of 2"), 20)
        assert page.text("#prompt-choices button:nth-child(2)") == "skip run 2"
        assert page.text("#pause") == "Pause after this run"
        page.click("#prompt-choices button:last-child")
        page.wait_for(has("#banner-title", "Ended by the operator"))
        assert run.wait(10) == 0


def test_a_page_calls_when_a_run_asks_hangs_and_ends(
    tmp_path: Path, device: Device, browser: Browser, panel: Panel
) -> None:
    page = browser.open(panel.url, script=HEARD)
    page.wait_for(has("#state", "No run"))
    assert page.text("#sound") == "Allow sound"  # which a browser leaves to people
    page.click("#sound")
    assert page.text("#sound") == "Sound on"
    assert page.evaluate("tones") == 1
    page.evaluate("tones = 0")
    client = Client(tmp_path, device, PROMPTS, attended=True)
    page.wait_for("document.title === 'Answer needed \u2013 With prompts'")
    assert page.evaluate("tones") == 2
    assert page.evaluate("messages.at(-1)") == "Stand the robot on the start line."
    client.kill("SIGSTOP")
    page.wait_for("document.title === 'Controller does not answer \u2013 With prompts'", 3)
    assert page.evaluate("tones") == 8
    client.kill("SIGCONT")
    page.wait_for("document.title === 'Answer needed \u2013 With prompts'")
    before = page.evaluate("tones")
    page.click("#sound")
    assert page.text("#sound") == "Sound off"
    client.kill("SIGINT")
    client.end()
    page.wait_for("document.title.startsWith('Stopped by the user')")
    assert page.evaluate("tones") == before  # it was switched off
    page.click("#sound")
    assert page.evaluate("tones") == before + 1
    page.evaluate("called = { question: null, end: '', trouble: '' }; showState()")
    assert page.evaluate("tones") == before + 4  # three for an end
    page.close()


@pytest.mark.parametrize("how", ["stuck", "broken off"])
def test_a_page_that_hears_nothing_says_of_nothing_that_it_is_so(
    tmp_path: Path, device: Device, browser: Browser, panel: Panel, how: str
) -> None:
    page = browser.open(panel.url, script=MUTED)
    client = Client(tmp_path, device, PROTOCOL.replace("duration: 3 s", "duration: 60 s"))
    client.heard_until("voltage")
    page.wait_for(has("#output", "on"))
    page.wait_for(has("#volts", "."))
    page.wait_for(has("#runs", "running"))
    if how == "stuck":
        page.evaluate("muted = true")
    else:
        panel.stop()
    page.wait_for(has("#output", "Not known"), 3)
    assert page.evaluate("document.querySelector('#output').className") == "value alarm"
    assert page.text("#phase") == "Not known"
    assert "not known" in page.text("#runs")
    assert "running" not in page.text("#runs")
    for shown in ("#set", "#volts", "#amps", "#elapsed", "#remaining"):
        assert page.text(shown) == "\u2013"
    assert page.evaluate("document.querySelector('#lamp').className") == "lamp alarm"
    assert page.evaluate("document.title").startswith("Panel lost")
    if how == "stuck":
        page.evaluate("muted = false")
        page.wait_for(has("#state", "Running"))
        page.wait_for(has("#output", "on"))
    client.kill("SIGINT")
    client.end()
    page.close()


def test_a_controller_that_is_killed_is_told_at_once_and_what_its_guardian_did(
    tmp_path: Path, device: Device, page: Page, capsys: pytest.CaptureFixture[str]
) -> None:
    client = Client(tmp_path, device)
    client.heard_until("voltage")
    page.wait_for(has("#state", "Running"))
    page.wait_for(has("#volts", "."))
    killed = client.kill("SIGKILL")
    page.wait_for("document.querySelector('#banner').classList.contains('alarm')")
    noticed = time.monotonic() - killed
    with capsys.disabled():
        print(f"\nred banner {1000 * noticed:.0f} ms after SIGKILL")
    assert noticed < GONE_BAR_S
    assert page.sees("#banner")
    # the output may be in doubt before that is known: the guardian asks the supply
    page.wait_for(has("#banner-title", "Controller gone"), GONE_BAR_S)
    page.wait_for(has("#banner-text", "switched the output off, and read back that it is off"))
    assert page.text("#output") == "off, confirmed"
    client.end()
    page.click("#stop")
    page.wait_for(has("#stop-says", "There is no run to stop"))
    assert "the switch on the supply" in page.text("#stop-says")


def test_a_controller_that_hangs_is_told_and_comes_back(
    tmp_path: Path, device: Device, page: Page
) -> None:
    client = Client(tmp_path, device, PROMPTS, attended=True)
    page.wait_for(has("#prompt-text", "Stand the robot"))
    client.kill("SIGSTOP")
    page.wait_for(has("#banner-title", "Controller does not answer"), 3)
    page.click("#stop")
    page.wait_for(has("#stop-says", "does not answer. Use the switch on the supply"))
    client.kill("SIGCONT")
    assert client.end() == 130  # it had been pressed
    page.wait_for(has("#state", "Ended"))


def test_a_stop_by_keyboard_is_the_first_tab_stop(page: Page) -> None:
    page.key("Tab", 9)
    assert page.evaluate("document.activeElement.id") == "stop"
    page.key("Enter", 13, "\r")
    page.wait_for(has("#stop-says", "There is no run to stop"))


def test_what_stop_says_before_the_first_state_comes_stays(browser: Browser, panel: Panel) -> None:
    page = browser.open(panel.url, script=HELD)
    page.click("#stop")
    page.wait_for(has("#stop-says", "There is no run to stop"))
    page.wait_for("held.some(([name]) => name === 'state')")
    page.evaluate("release()")
    assert page.evaluate("state.pid === null")
    assert page.text("#stop-says").startswith("There is no run to stop")
    page.close()


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (820, 1180), (390, 844), (320, 480)])
def test_stop_is_in_sight_and_large_wherever_the_page_is_scrolled(
    page: Page, width: int, height: int
) -> None:
    page.resize(width, height)
    for place in (0, 100_000):
        page.evaluate(f"window.scrollTo(0, {place})")
        box = page.evaluate("document.querySelector('#stop').getBoundingClientRect().toJSON()")
        assert box["top"] >= 0
        assert box["bottom"] <= height
        assert box["width"] >= 180
        assert box["height"] >= 70
    wide = page.evaluate("document.documentElement.scrollWidth")
    assert wide <= width  # nothing lies outside


def test_with_many_pages_open_stop_still_gets_through(browser: Browser, panel: Panel) -> None:
    pages = [browser.open(panel.url) for _ in range(7)]  # a browser has six connections to a host
    pages[0].wait_for(has("#banner-title", "Not live any more"))
    pages[0].click("#stop")
    took = pages[0].wait_for(has("#stop-says", "There is no run to stop"))
    assert took < STOP_BAR_S
    for one in pages:
        one.close()


def test_a_panel_that_is_gone_says_so(browser: Browser, panel: Panel) -> None:
    page = browser.open(panel.url)
    page.wait_for(has("#state", "No run"))
    page.wait_for(has("#start-fault", "no such folder"))  # nothing is on its way any more
    panel.stop()
    page.wait_for(has("#banner-title", "Panel lost"), 6)
    page.click("#stop")
    page.wait_for(has("#stop-says", "STOP was not received. Use the switch on the supply"))
    page.close()


def test_a_panel_that_looks_no_more_says_so(
    tmp_path: Path, browser: Browser, starter: Starter
) -> None:
    served = Panel(Watcher(tmp_path / "runs"), starter)  # its watcher was never started
    thread = threading.Thread(target=served.serve)
    thread.start()
    page = browser.open(served.url)
    page.wait_for(has("#banner-title", "Panel lost"), 8)
    page.close()
    served.stop()
    thread.join()


def test_browsers_that_never_read_slow_no_run(
    tmp_path: Path, device: Device, panel: Panel, page: Page
) -> None:
    token = panel.url.split("/")[3]
    stalled = [socket.create_connection((HERE, panel.port)) for _ in range(STALLED)]
    for one in stalled:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        one.sendall(f"GET /{token}/events HTTP/1.1\r\nHost: {HERE}:{panel.port}\r\n\r\n".encode())
    client = Client(tmp_path, device, PROTOCOL.replace("duration: 3 s", "duration: 4 s"))
    client.heard_until("output_off")
    page.wait_for(has("#output", "off, confirmed"))  # who reads is served
    client.end()
    events = journal_of(client.bundle)
    times = {event["event"]: event["time_s"] for event in events}
    assert times["output_off"] - times["output_on"] < 4.5
    read = [event["time_s"] for event in events if event["event"] == "reading"]
    assert max(after - before for before, after in pairwise(read)) < 0.45
    assert manifest_of(client.bundle)["output_off"] == "confirmed"
    for one in stalled:
        one.close()


def test_the_page_shows_the_run_s_place_times_and_readings(
    tmp_path: Path, device: Device, page: Page
) -> None:
    client = Client(tmp_path, device)
    client.heard_until("voltage")
    page.wait_for(has("#run-place", "Run 1 of 1"))
    page.wait_for(has("#phase", "drive 3 s: 4.52 V, 16.988 rad/s"))
    page.wait_for("readings.set_V.at(-1) === 4.52")
    assert page.evaluate("readings.time_s.length === readings.amps.length")
    drawn = "document.querySelector('#plot').getContext('2d').getImageData(0, 0, 600, 200).data"
    assert page.evaluate(f"new Set({drawn}).size") > 5
    remaining = page.evaluate("now().remaining")
    assert 0 < remaining < 3.5
    elapsed = page.evaluate("now().elapsed")
    page.wait_for(f"now().elapsed > {elapsed} + 0.5 && now().remaining < {remaining} - 0.4")
    page.wait_for(has("#runs", "running"))
    client.kill("SIGINT")
    client.end()
    page.wait_for(has("#runs", "interrupted"))


def test_text_of_a_protocol_stays_text(tmp_path: Path, device: Device, page: Page) -> None:
    nasty = "<img src=x onerror=alert(1)>"
    client = Client(tmp_path, device, PROMPTS.replace("With prompts", f"'{nasty}'"), attended=True)
    page.wait_for("!document.querySelector('#prompt').hidden")
    assert page.text("#title") == nasty
    assert page.evaluate("document.querySelector('#title').children.length") == 0
    assert client.process.pid is not None
    os.kill(client.process.pid, signal.SIGINT)
    client.end()


def test_a_supply_that_does_not_obey_is_told_in_red(
    tmp_path: Path, device: Device, page: Page
) -> None:
    client = Client(tmp_path, device)
    client.heard_until("voltage")
    device.fail(SimulatedFault.STUCK_OUTPUT)
    page.click("#stop")
    page.wait_for(has("#banner-text", "OUTPUT MAY BE ON"))
    assert page.evaluate("document.querySelector('#banner').className") == "banner alarm"
    client.end()
