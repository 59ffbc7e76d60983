"""What others reported of benches, and what an attacker tries, done with stubs that share nothing.

Ways to lose a supply while it drives are in `test_losses.py`, killed processes in `test_kills.py`,
channels and scales in `hw/test_hw_foreign.py`, the record of a run in `test_engine_guarded.py`.
"""

from __future__ import annotations

import json
import os
import re
import socket
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.bundles import guardian_of
from tests.conftest import Command
from tests.hw.foreign import Ka3005p, Rd6006, served
from tests.hw.guardian_rig import Device, DeviceProcess, device_process, wait_for
from tests.killing import Client, lab_file
from tests.losing import CLIENT, LossyLine, Terminal
from workbench.hw import Connection, SimulatedFault, Supply, SystemClock, open_supply

pytestmark = pytest.mark.xdist_group("alone")  # what is told when is timed

posix = pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo terminal")
SOON_S = 1.0


@pytest.fixture(scope="module")
def devices() -> Iterator[DeviceProcess]:
    with device_process() as found:
        yield found


@pytest.fixture
def device(devices: DeviceProcess) -> Device:
    return devices.new()


def lab(folder: Path, model: str, connection: str) -> Path:
    """Write a bench whose supply is a stub."""
    own = Path(__file__).resolve().parents[2] / "workbench" / "run" / "bench-virtual.yaml"
    text, _, _ = own.read_text(encoding="utf-8").partition("virtual:\n")
    text = text.replace("{kind: simulated}", connection).replace("RD6006", model)
    path = folder / "lab.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@contextmanager
def endless(data: bytes) -> Iterator[str]:
    """Serve whoever connects with bytes without end."""
    stop = threading.Event()

    def send(link: socket.socket) -> None:
        with suppress(OSError), link:
            while not stop.is_set():
                link.sendall(data)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(0.05)

        def accept() -> None:
            while not stop.is_set():
                with suppress(TimeoutError):
                    threading.Thread(target=send, args=listener.accept()[:1], daemon=True).start()

        thread = threading.Thread(target=accept)
        thread.start()
        try:
            yield f"127.0.0.1:{listener.getsockname()[1]}"
        finally:
            stop.set()
            thread.join()


@pytest.mark.parametrize(
    ("model", "kind"),
    [("E36312A", "tcp"), ("KA3005P", "tcp"), ("RD6006", "tcp"), ("RD6006", "rtu-over-tcp")],
)
@pytest.mark.parametrize(
    "data", [b"y\n", b"\x00", b"\x01\x03\x08\x00"], ids=["text", "zeros", "frames"]
)
def test_a_peer_that_sends_without_end_is_told_within_seconds(
    tmp_path: Path, workbench: Command, model: str, kind: str, data: bytes
) -> None:
    with endless(data * 1024) as address:
        path = lab(tmp_path, model, f"{{kind: {kind}, address: '{address}'}}")
        began = time.monotonic()
        answer = workbench("supply", "read", "--bench", path)
    assert answer.code == 3
    assert time.monotonic() - began < 6
    assert re.search("never becomes idle|no known model|damaged|is not known", answer.err), (
        answer.err
    )


def test_doctor_ends_before_a_peer_that_sends_without_end(
    tmp_path: Path, workbench: Command
) -> None:
    with endless(b"y\n" * 2048) as address:
        path = lab(tmp_path, "E36312A", f"{{kind: tcp, address: '{address}'}}")
        began = time.monotonic()
        answer = workbench("doctor", "--bench", path)
    assert time.monotonic() - began < 20
    assert answer.code != 0
    assert "supply" in answer.out


class Echoing(Rd6006):
    """A Riden behind an adapter that sends back what it is sent."""

    def receive(self, data: bytes) -> list[bytes]:
        return [data, *super().receive(data)]


class EchoingKorad(Ka3005p):
    def receive(self, data: bytes) -> list[bytes]:
        return [data, *super().receive(data)]


def test_an_adapter_that_echoes_is_named_and_can_be_told_of(
    tmp_path: Path, workbench: Command
) -> None:
    for stub, model, kind in (
        (Echoing(), "RD6006", "rtu-over-tcp"),
        (EchoingKorad(), "KA3005P", "tcp"),
    ):
        stub.put(2.5, True)
        with served(stub) as address:
            place = f"kind: {kind}, address: '{address}'"
            answer = workbench("supply", "read", "--bench", lab(tmp_path, model, f"{{{place}}}"))
            assert answer.code == 3
            words = "the adapter sends back what it is sent.*write `echo: true` below `connection`"
            assert re.search(words, answer.err), answer.err
            path = lab(tmp_path, model, f"{{{place}, echo: true}}")
            answer = workbench("supply", "read", "--bench", path, "--json")
            assert answer.code == 0, answer.err
            assert answer.json["voltage_V"] == 2.5


class ShortReads(Rd6006):
    """A Riden behind a bridge that passes reads of at most 16 registers."""

    def receive(self, data: bytes) -> list[bytes]:
        count = data[4] << 8 | data[5]
        return [] if data[1] == 3 and count > 16 else super().receive(data)


def test_a_bridge_that_passes_sixteen_registers_is_enough(
    tmp_path: Path, workbench: Command
) -> None:
    stub = ShortReads()
    with served(stub) as address:
        path = lab(tmp_path, "RD6006", f"{{kind: rtu-over-tcp, address: '{address}'}}")
        for _ in range(5):  # lengths differ from read to read
            assert workbench("supply", "read", "--bench", path).code == 0
        answer = workbench("supply", "set", "2 V", "--bench", path, "--for", "1 s", "--json")
    assert answer.code == 0, answer.err
    assert answer.json["voltage_V"] == 2.0
    assert stub.terminals().live == 0


def test_at_first_contact_nothing_is_said_of_what_went_before(
    tmp_path: Path, workbench: Command
) -> None:
    with served(Rd6006()) as address:
        path = lab(tmp_path, "RD6006", f"{{kind: rtu-over-tcp, address: '{address}', unit: 2}}")
        answer = workbench("supply", "read", "--bench", path)
    assert answer.code == 3
    assert "as before it" not in answer.err
    assert "read of 4 registers from 0: no answer within 0.5 s" in answer.err
    assert "unit id 2" in answer.err


def test_a_supply_found_on_that_does_not_obey_is_never_called_off(
    tmp_path: Path, device: Device, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("workbench.run.bench.RealBench.keep_trying_s", 1.0)
    device.write(8, 1200)
    device.write(18, 1)
    device.fail(SimulatedFault.STUCK_OUTPUT)
    client = Client(tmp_path, device)
    assert client.end(120) == 4
    told = client.err.read_text()
    assert "OUTPUT MAY BE ON" in told
    assert "never switched on" not in told
    assert "confirmed;" not in told
    assert client.bundle.record.output_off == "unconfirmed"
    assert client.standing() is not None
    device.mend()


def test_another_spelling_of_the_address_and_another_folder_are_latched_too(
    tmp_path: Path, device: Device, workbench: Command
) -> None:
    path = lab_file(tmp_path, device)
    device_off = workbench("supply", "set", "2 V", "--bench", path, "--for", "0.2 s")
    assert device_off.code == 0
    threading.Timer(2.0, lambda: device.fail(SimulatedFault.PANEL_OFF)).start()
    assert workbench("supply", "set", "2 V", "--bench", path).code == 4
    path.write_text(path.read_text().replace("127.0.0.1", "localhost"))
    (tmp_path / "p.yaml").write_text(
        "schema: workbench/protocol-1\ntitle: T\nsteps:\n"
        "  - run: {mode: clamped, speed: 17 rad/s, rest: 0.5 s, duration: 1 s}\n"
    )
    words = "run", tmp_path / "p.yaml", "--bench", path, "--runs", tmp_path / "other"
    answer = workbench(*words)
    assert answer.code == 4
    assert "is latched since" in answer.err
    assert "its output went off, not by this program" in answer.err
    assert device.volts == 0


SHIFTED = """
    import os, time
    true = time.time
    def shifted():
        try:
            return true() + float(open(os.environ["SHIFT"]).read())
        except (OSError, ValueError):
            return true()
    time.time = shifted
"""


@posix
@pytest.mark.parametrize("way", ["riden pty", "korad pty", "riden rtu-over-tcp"])
@pytest.mark.parametrize("hours", [-1, 1])
def test_a_step_of_the_clock_changes_nothing(tmp_path: Path, way: str, hours: int) -> None:
    (tmp_path / "sitecustomize.py").write_text(textwrap.dedent(SHIFTED))
    family, transport = way.split(" ")
    make, model = {"riden": (Rd6006, "RD6006"), "korad": (Ka3005p, "KA3005P")}[family]
    line = LossyLine(make, family, transport, tmp_path)
    shift = tmp_path / "shift"
    words = [family, line.kind, line.address, model, str(tmp_path), "10", "2.5"]
    env = {"PYTHONPATH": str(tmp_path), "SHIFT": str(shift)}
    terminal = Terminal([sys.executable, "-c", textwrap.dedent(CLIENT), *words], tmp_path, env)
    try:
        terminal.wait_for("on", 30)
        line.lose("silence")  # an answer is waited for while the clock is set
        time.sleep(0.25)
        shift.write_text(str(3600 * hours))
        time.sleep(0.15)
        terminal.process.kill()
        killed = time.monotonic()
        line.mend()
        wait_for(lambda: line.stub.terminals().live == 0, 5)
        assert time.monotonic() - killed < SOON_S + 0.5
    finally:
        terminal.end()
        line.close()


PORTS = """
    import json, os
    from serial.tools import list_ports
    from serial.tools.list_ports_common import ListPortInfo
    def comports(include_links=False):
        found = []
        for name in json.load(open(os.environ["PORTS"])):
            port = ListPortInfo(name)
            port.vid, port.pid, port.serial_number = 0x1A86, 0x7523, None
            found.append(port)
        return found
    list_ports.comports = comports
"""


@posix
@pytest.mark.parametrize("client", ["alive", "killed"])
def test_a_supply_that_comes_back_under_another_name_is_switched_off(
    tmp_path: Path, client: str
) -> None:
    (tmp_path / "sitecustomize.py").write_text(textwrap.dedent(PORTS))
    ports = tmp_path / "ports.json"
    line = LossyLine(Rd6006, "riden", "pty", tmp_path)
    stranger = LossyLine(Rd6006, "riden", "pty", _made(tmp_path / "stranger"))
    stranger.stub.words[2] ^= 1  # type: ignore[attr-defined]  # another serial number
    stranger.stub.put(3.0, True)
    here = os.path.realpath(line.address)
    ports.write_text(json.dumps([here, os.path.realpath(stranger.address)]))
    words = ["riden", "serial", here, "RD6006", str(tmp_path), "15", "2.5"]
    env = {"PYTHONPATH": str(tmp_path), "PORTS": str(ports)}
    terminal = Terminal([sys.executable, "-c", textwrap.dedent(CLIENT), *words], tmp_path, env)
    try:
        terminal.wait_for("on", 30)
        line.unplug()
        if client == "killed":
            terminal.process.kill()
        time.sleep(1.0)
        line.plug_in()
        there = os.path.realpath(line.address)
        assert there != here
        ports.write_text(json.dumps([os.path.realpath(stranger.address), there]))
        back = time.monotonic()
        wait_for(lambda: line.stub.terminals().live == 0, 5)
        assert time.monotonic() - back < 2 * SOON_S  # the stranger is asked first
        assert stranger.stub.terminals().live == 3.0  # and left alone
    finally:
        terminal.end()
        line.close()
        stranger.close()
    log = (tmp_path / "guardian.jsonl").read_text()
    assert f'"event": "found", "address": "{there}"' in log
    assert '"dead": true' in log.splitlines()[-2]


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


@posix
def test_a_supply_without_a_port_is_found_by_its_serial_number(
    tmp_path: Path, workbench: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    line = LossyLine(Rd6006, "riden", "pty", tmp_path)
    other = LossyLine(Rd6006, "riden", "pty", _made(tmp_path / "other"))
    other.stub.words[2] ^= 1  # type: ignore[attr-defined]
    names = [os.path.realpath(one.address) for one in (other, line)]

    class Port:
        def __init__(self, device: str) -> None:
            self.device, self.vid, self.pid, self.serial_number = device, 1, 2, None

    monkeypatch.setattr("workbench.hw.ports.comports", lambda: [Port(name) for name in names])
    try:
        with open_of(names[1]) as supply:
            serial = supply.identify().serial
        path = lab(tmp_path, "RD6006", "{kind: serial}")
        answer = workbench("supply", "read", "--bench", path)
        assert answer.code == 2
        assert "kind: serial needs a port, or the supply's serial number" in answer.err
        text = path.read_text().replace("  connection", f"  serial: {int(serial)}\n  connection")
        path.write_text(text)
        found = workbench("supply", "read", "--bench", path, "--json")
        assert found.code == 0, found.err
        assert found.json["serial"] == serial
        path.write_text(text.replace(f"serial: {int(serial)}", "serial: 4711"))
        missing = workbench("supply", "read", "--bench", path)
        assert missing.code == 3
        told = " ".join(missing.err.split())
        assert "no RD6006 with serial number 00004711 at any port" in told
        assert f"(RD6006 {serial})" in told
    finally:
        line.close()
        other.close()


@contextmanager
def open_of(port: str) -> Iterator[Supply]:
    supply = open_supply(
        Connection("serial", port, baud=9600), clock=SystemClock(), wire_log=lambda line: None
    )
    try:
        yield supply
    finally:
        supply.close()


def test_the_next_command_of_any_kind_tells_of_an_output_that_may_be_on(
    tmp_path: Path, device: Device
) -> None:
    client = Client(tmp_path, device)
    client.heard_until("output_on")
    wait_for(lambda: device.volts > 1)
    os.kill(guardian_of(client.bundle)[0]["pid"], 9)
    client.kill("SIGKILL")
    client.end()
    wait_for(lambda: not any(one.held() for one in client.ledgers()))  # a write ends first
    env = os.environ | {"WORKBENCH_STATE": str(client.state)}
    for words in (["--help"], ["schema", "model"], ["runs", "list"], ["supply", "models"]):
        code = "from workbench.cli import main; main()"
        done = subprocess.run(
            [sys.executable, "-c", code, *words],
            env=env,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0
        told = r"RD6006_12345678 at 127\.0\.0\.1:\d+ is latched since .*OUTPUT MAY BE ON, switch it"
        assert re.search(told, done.stderr), words
