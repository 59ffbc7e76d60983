"""Who may do what at the panel's server, and what it serves."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import tracemalloc
from contextlib import suppress
from datetime import datetime, timedelta
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.bundles import asked_for, note
from workbench.bundle import Bundle
from workbench.errors import InputError
from workbench.loopback import HERE
from workbench.panel import Panel, Starter, Watcher
from workbench.panel.listing import MOST_ROWS, Listing

PAGE = Path(__file__).resolve().parents[2] / "workbench" / "panel" / "page"
NOWHERE = "http://www.w3.org/2000/svg"  # a name, which nothing is loaded from


class Answered(NamedTuple):
    code: int
    text: str
    headers: http.client.HTTPMessage


def ask(panel: Panel, path: str, method: str = "GET", **headers: str) -> Answered:
    """Send one request as it is, without making the path any better."""
    link = http.client.HTTPConnection(HERE, panel.port, timeout=10)
    try:
        body = headers.pop("body", None)
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        link.request(method, path, body, named)
        found = link.getresponse()
        return Answered(found.status, found.read().decode(), found.headers)
    finally:
        link.close()


@pytest.fixture
def own(panel: Panel) -> str:
    """The path of the page, which begins with the token."""
    return "/" + panel.url.split("/", 3)[3]


@pytest.fixture
def report(tmp_path: Path, panel: Panel) -> Path:
    bundle = Bundle.create(
        tmp_path / "runs", "hop", datetime(2026, 3, 12, 16), asked_for(title="T")
    )
    bundle.view("report").write_text("<p>a report</p>")
    bundle.finish("complete")
    (tmp_path / "report.html").write_text("a secret")
    (tmp_path / "manifest.json").write_text((bundle.path / "manifest.json").read_text())
    return bundle.path


def listed(panel: Panel, own: str) -> list[str]:
    """Wait until the runs are listed, and return their names."""
    link = http.client.HTTPConnection(HERE, panel.port, timeout=10)
    link.request("GET", f"{own}events")
    stream = link.getresponse()
    while True:
        line = stream.readline().decode()
        if '"rows"' in line and (rows := json.loads(line[len("data: ") :])["rows"]):
            link.close()
            return [row["name"] for row in rows]


def test_the_page_is_served_to_whoever_knows_its_address(panel: Panel, own: str) -> None:
    found = ask(panel, own)
    assert found.code == 200
    assert "This panel is no safety device." in found.text
    assert ask(panel, f"{own}panel.js").headers["content-type"].startswith("text/javascript")
    assert "script-src 'self'" in found.headers["content-security-policy"]
    assert "unsafe" not in found.headers["content-security-policy"]
    assert found.headers["referrer-policy"] == "no-referrer"
    assert "access-control-allow-origin" not in found.headers
    assert len(own) >= 32


@pytest.mark.parametrize(
    "path", ["/", "/wrong/", "/wrong/stop", "/events", "/wrong/runs/x/report.html"]
)
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_a_wrong_token_is_refused(panel: Panel, path: str, method: str) -> None:
    origin = f"http://{HERE}:{panel.port}"
    found = ask(panel, path, method, Origin=origin)
    assert found.code == 403
    assert "the address has no token" in found.text


@pytest.mark.parametrize("host", ["evil.example", "evil.example:{}", "127.0.0.1", "[::1]:{}", ""])
def test_another_host_name_is_refused(panel: Panel, own: str, host: str) -> None:
    found = ask(panel, own, Host=host.format(panel.port))
    assert found.code == 403
    assert "for this computer alone" in found.text
    assert ask(panel, own, Host=f"localhost:{panel.port}").code == 200


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "", "https://127.0.0.1:{}"])
def test_the_page_of_another_site_stops_nothing(panel: Panel, own: str, origin: str) -> None:
    headers = {"Origin": origin.format(panel.port)} if origin else {}
    found = ask(panel, f"{own}stop", "POST", **headers)
    assert found.code == 403
    assert "only the panel's own page" in found.text


def test_looking_stops_nothing(panel: Panel, own: str) -> None:
    assert ask(panel, f"{own}stop").code == 404  # only POST does


def test_an_answer_that_nobody_asked_for_is_told(panel: Panel, own: str) -> None:
    origin = f"http://{HERE}:{panel.port}"
    body = json.dumps({"question": 1, "text": "x"})
    headers = {"Origin": origin, "content_type": "application/json"}
    found = ask(panel, f"{own}answer", "POST", body=body, **headers)
    assert json.loads(found.text) == {"taken": False, "text": "No run waits for an answer."}
    long = json.dumps({"question": 1, "text": "x" * 3000})
    assert ask(panel, f"{own}answer", "POST", body=long, **headers).code == 422


def test_a_pause_of_no_run_is_told(panel: Panel, own: str) -> None:
    origin = f"http://{HERE}:{panel.port}"
    headers = {"Origin": origin, "content_type": "application/json"}
    found = ask(panel, f"{own}pause", "POST", body='{"on": true}', **headers)
    assert json.loads(found.text) == {"pausing": False, "text": "No run is under way."}
    assert ask(panel, f"{own}pause", "POST", body='{"on": true}').code == 403  # of another page


def raw(panel: Panel, own: str, path: str, *heads: str, method: str = "POST") -> socket.socket:
    """A connection on which the head of a request was sent."""
    link = socket.create_connection((HERE, panel.port), 10)
    origin = f"http://{HERE}:{panel.port}"
    lines = [f"{method} {own}{path} HTTP/1.1", f"Host: {HERE}:{panel.port}", f"Origin: {origin}",
             "Content-Type: application/json", *heads]  # fmt: skip
    link.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
    return link


def heard(link: socket.socket) -> str:
    """Everything that is answered until the connection is closed."""
    told = b""
    with suppress(ConnectionResetError):
        while data := link.recv(65536):
            told += data
    return told.decode()


BIG = 300 * 1024 * 1024


@pytest.mark.parametrize("path", ["answer", "stop", "", "events", "gone/x"])
@pytest.mark.parametrize("method", ["POST", "PUT", "GET", "DELETE"])
def test_a_large_body_is_refused_before_it_is_sent(
    panel: Panel, own: str, path: str, method: str
) -> None:
    began = time.monotonic()
    with raw(panel, own, path, f"Content-Length: {BIG}", method=method) as link:
        told = heard(link)
    assert told.startswith("HTTP/1.1 413 "), told
    assert f"{BIG} bytes; a body may have at most 65536" in told
    assert time.monotonic() - began < 1


@pytest.mark.parametrize(
    ("heads", "code"),
    [
        (("Transfer-Encoding: chunked",), 411),
        (("Content-Length: 9999999999999999999",), 413),
        (("Content-Length: 65537",), 413),
        (("Content-Length: -1",), 400),
        (("Content-Length: 10", "Content-Length: 999999999"), 400),
        (("Expect: 100-continue", f"Content-Length: {BIG}"), 413),
    ],
)
def test_a_length_that_is_none_or_too_large_is_refused(
    panel: Panel, own: str, heads: tuple[str, ...], code: int
) -> None:
    with raw(panel, own, "answer", *heads) as link:
        assert heard(link).startswith(f"HTTP/1.1 {code} ")


@pytest.mark.parametrize("head", [f"Content-Length: {BIG}", "Transfer-Encoding: chunked"])
def test_a_body_that_comes_all_the_same_takes_no_memory(panel: Panel, own: str, head: str) -> None:
    piece = b"x" * 65536 if "Length" in head else b"10000\r\n" + b"x" * 65536 + b"\r\n"
    sent = 0
    tracemalloc.start()
    try:
        with raw(panel, own, "answer", head) as link:
            with suppress(OSError):
                while sent < BIG:
                    sent += link.send(piece)
            peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert sent < BIG / 10
    assert peak < 20e6


def test_a_body_that_comes_slowly_is_given_up(
    panel: Panel, own: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("workbench.panel.guard.BODY_S", 0.2)
    with raw(panel, own, "answer", "Content-Length: 100") as link:
        link.sendall(b"{")
        told = heard(link)
    assert told.startswith("HTTP/1.1 408 ")
    assert "the body did not come within 0.2 s" in told
    assert ask(panel, own).code == 200


def test_a_body_in_pieces_is_read(panel: Panel, own: str) -> None:
    body = json.dumps({"question": 1, "text": "x"}).encode()
    head = f"Content-Length: {len(body)}"
    with raw(panel, own, "answer", head, "Connection: close") as link:
        for byte in body:
            link.sendall(bytes([byte]))
        assert "No run waits for an answer." in heard(link)


def test_a_report_is_served_and_can_do_nothing(panel: Panel, own: str, report: Path) -> None:
    assert listed(panel, own) == [report.name]
    found = ask(panel, f"{own}runs/{report.name}/report.html")
    assert found.code == 200
    assert found.text == "<p>a report</p>"
    assert found.headers["content-security-policy"].startswith("sandbox")
    assert "allow-scripts" not in found.headers["content-security-policy"]


@pytest.mark.parametrize(
    "way",
    ["..", "../..", "%2e%2e", "..%2f..", "%2e%2e%2f%2e%2e", "{run}/..", "{run}%2f..", ".", "",
     "..%5c..", "/etc", "%2fetc", "{run}%00"],
)  # fmt: skip
def test_no_path_leads_out_of_the_folder_of_runs(
    panel: Panel, own: str, report: Path, way: str
) -> None:
    listed(panel, own)
    found = ask(panel, f"{own}runs/{way.format(run=report.name)}/report.html")
    assert found.code == 404
    assert "secret" not in found.text


@pytest.mark.skipif(sys.platform == "win32", reason="needs symbolic links")
def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path, report: Path) -> None:
    outside = tmp_path / "outside"
    report.rename(outside)
    (tmp_path / "runs" / "x").symlink_to(outside)
    listing = Listing(tmp_path / "runs")
    listing.refresh()
    assert [row["name"] for row in listing.rows()["rows"]] == ["x"]
    assert listing.view_of("x", "report") is None


def test_the_list_is_of_the_newest_and_follows_the_folder(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    for number in range(MOST_ROWS + 2):
        Bundle.create(runs, f"n{number:03}", datetime(2026, 3, 12) + timedelta(seconds=number))
    (runs / "damaged").mkdir()
    (runs / "damaged" / "manifest.json").write_text("{")
    listing = Listing(runs)
    listing.refresh()
    found = listing.rows()
    assert found["all"] == MOST_ROWS + 2
    assert [row["name"][-4:] for row in found["rows"]][:2] == ["n101", "n100"]
    assert len(found["rows"]) == MOST_ROWS
    newest = Bundle.open(runs / found["rows"][0]["name"])
    assert found["rows"][0]["status"] == "not finished"
    note(newest, real={"distance_m": 1.25}, twin={"displacement_m": 0.0}, error_mm=7.0)
    newest.finish("complete")
    listing.refresh()
    first = listing.rows()["rows"][0]
    assert (first["status"], first["real_m"], first["twin_m"]) == ("complete", 1.25, None)


def test_nothing_of_the_page_comes_from_elsewhere() -> None:
    names = {path.name for path in PAGE.iterdir()}
    own = {"index.html", "panel.css", "panel.js", "start.js", "icon.svg"}
    assert names == own | {"list.html", "list.js", "runs.css"}
    for name in names:
        text = (PAGE / name).read_text(encoding="utf-8").replace(NOWHERE, "")
        assert not re.search(r"(https?:)?//[\w.]+\.\w|@import|url\(|innerHTML|eval\(", text), name


def test_it_listens_on_this_computer_alone(panel: Panel, starter: Starter) -> None:
    assert panel._socket.getsockname()[0] == "127.0.0.1"
    with (
        Watcher(Path("nowhere")) as watcher,
        pytest.raises(InputError, match=rf"port {panel.port} cannot be used \(.*\); try --port 0"),
    ):
        Panel(watcher, starter, panel.port)


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")
def test_the_command_prints_its_address_and_ends_with_ctrl_c(tmp_path: Path) -> None:
    words = "import sys; from workbench.cli import main; sys.argv[0] = 'workbench'; main()"
    command = [sys.executable, "-c", words, "panel", "--json", "--runs", str(tmp_path / "runs")]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path
    ) as process:
        assert process.stdout is not None
        told = "".join(iter(process.stdout.readline, "}\n")) + "}"
        found = json.loads(told)
        link = http.client.HTTPConnection(HERE, found["port"], timeout=10)
        link.request("GET", found["url"].split(str(found["port"]))[1])
        assert link.getresponse().status == 200
        link.close()
        assert found["pid"] == process.pid
        os.kill(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=20)
    assert process.returncode == 0
    assert "panel closed; a run goes on without it" in err
    assert list(tmp_path.iterdir()) == []  # looking leaves nothing behind
