"""Who may do what at the panel's server, and what it serves."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import subprocess
import sys
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import pytest

from workbench.bundle import Bundle
from workbench.errors import InputError
from workbench.loopback import HERE
from workbench.panel import Panel, Watcher
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
    bundle = Bundle.create(tmp_path / "runs", "hop", datetime(2026, 3, 12, 16), {"title": "T"})
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
    assert "the address lacks its token" in found.text


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
    assert listing.report_of("x") is None


def test_the_list_is_of_the_newest_and_follows_the_folder(tmp_path: Path) -> None:
    runs = tmp_path / "runs"
    for number in range(MOST_ROWS + 2):
        Bundle.create(runs, f"n{number:03}", datetime(2026, 3, 12), {"created": f"{number:03}"})
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
    newest.note({"real": {"distance_m": 1.25}, "error_mm": 7.0})
    newest.finish("complete")
    listing.refresh()
    first = listing.rows()["rows"][0]
    assert (first["status"], first["real_m"], first["twin_m"]) == ("complete", 1.25, None)


def test_nothing_of_the_page_comes_from_elsewhere() -> None:
    names = {path.name for path in PAGE.iterdir()}
    assert names == {"index.html", "panel.css", "panel.js", "icon.svg"}
    for name in names:
        text = (PAGE / name).read_text(encoding="utf-8").replace(NOWHERE, "")
        assert not re.search(r"(https?:)?//[\w.]+\.\w|@import|url\(|innerHTML|eval\(", text), name


def test_it_listens_on_this_computer_alone(panel: Panel) -> None:
    assert panel._socket.getsockname()[0] == "127.0.0.1"
    with (
        Watcher(Path("nowhere")) as watcher,
        pytest.raises(InputError, match=rf"port {panel.port} cannot be used \(.*\); try --port 0"),
    ):
        Panel(watcher, panel.port)


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
