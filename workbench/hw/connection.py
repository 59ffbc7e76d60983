"""Where a supply is, and what to do when nothing opens there."""

from __future__ import annotations

import functools
import os
import socket
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from serial.tools.list_ports import comports

from workbench.errors import HardwareError, InputError

__all__ = ["Connection", "Kind", "not_reachable", "port_trouble", "require_reachable", "resolved"]

_REACHED_S = 3.0

Kind = Literal["serial", "rtu-over-tcp", "tcp"]


@dataclass(frozen=True)
class Connection:
    """Where a supply is.

    Args:
        kind: serial port, RTU frames over TCP (a serial bridge), or Modbus TCP.
        address: port name (`COM4`, `/dev/serial/by-id/...`), or `host:port`.
        baud: serial speed, 8N1.
        unit: Modbus unit id.
        timeout_s: how long an answer may take; under 0.5 s RD firmware 1.42 fails.
        gap_s: least time between an answer and the next command; None keeps what the family needs.
        echo: whether the adapter sends back what it is sent, as some for RS485 do.
        channel: which of a supply's outputs is driven.

    Raises:
        InputError: when a TCP address is not `host:port`.
    """

    kind: Kind
    address: str
    baud: int = 115200
    unit: int = 1
    timeout_s: float = 0.5
    gap_s: float | None = None
    echo: bool = False
    channel: int = 1

    def __post_init__(self) -> None:
        """Find a bad address now and not when connecting."""
        host, _, port = self.address.rpartition(":")
        if self.kind != "serial" and not (host and port.isdecimal() and 0 < int(port) < 65536):
            raise InputError(f"address {self.address!r} of a {self.kind} link is not host:port")

    @property
    def host_and_port(self) -> tuple[str, int]:
        """The two parts of a TCP address."""
        host, _, port = self.address.rpartition(":")
        return host, int(port)

    @property
    def resolved_address(self) -> str:
        """The address as it resolves: one name for `localhost` and 127.0.0.1, a link and a port."""
        if self.kind == "serial":
            known = self.address and os.name == "posix"
            return os.path.realpath(self.address) if known else self.address
        host, port = self.host_and_port
        with suppress(OSError):
            host = str(resolved(host, port)[1][0])
        return f"{host}:{port}"


@functools.cache
def resolved(host: str, port: int) -> tuple[socket.AddressFamily, tuple[str, int]]:
    """Look a host up once: a name server must not be waited for on the way to "off".

    Raises:
        OSError: when there is no such host.
    """
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    family, _, _, _, address = min(found, key=lambda one: one[0] != socket.AF_INET)
    return family, (str(address[0]), int(address[1]))


def require_reachable(connection: Connection) -> None:
    """Refuse a place that cannot be opened; nothing is sent there.

    Raises:
        HardwareError: with what to do.
    """
    if connection.kind == "serial":
        if os.name == "posix" and not os.access(connection.address, os.R_OK | os.W_OK):
            raise HardwareError(not_reachable(connection))
        return
    try:
        family, address = resolved(*connection.host_and_port)
        with socket.socket(family) as link:
            link.settimeout(_REACHED_S)
            link.connect(address)
    except OSError:
        raise HardwareError(not_reachable(connection)) from None


def not_reachable(connection: Connection) -> str:
    """Say what did not open and what to try."""
    if connection.kind != "serial":
        return (
            f"{connection.address} not reachable: nothing accepts a connection there; check the "
            "address, the network and that the bridge or simulated supply is running"
        )
    return f"{connection.address} not reachable: {port_trouble(connection.address)}"


def port_trouble(port: str) -> str:
    """Say why a serial port does not open, as far as the system says, and what to do."""
    present = ", ".join(found.device for found in comports()) or "none"
    if os.name == "posix" and not Path(port).exists():
        return f"there is no such port; is the cable in, the supply on? Ports present: {present}"
    if os.name == "posix" and not os.access(port, os.R_OK | os.W_OK):
        return (
            "this user may not open the port; join the group that owns it with "
            f"`sudo usermod -aG dialout $USER`, then log in anew. Ports present: {present}"
        )
    return (
        "the port does not open; is another program holding it, or is it no serial port? Close "
        f"that program, or name another port. Ports present: {present}"
    )
