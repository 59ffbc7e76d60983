"""A simulated device on a TCP port or a pseudo terminal: threads that pass bytes."""

from __future__ import annotations

import os
import select
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from workbench.errors import InputError
from workbench.hw.simulated.device import Framing, SimulatedSupply, Wire

__all__ = ["serve", "serve_terminal"]

POLL_S = 0.02  # how soon a server notices that its supply was unplugged
CHUNK = 4096


@contextmanager
def serve(
    device: SimulatedSupply, host: str = "127.0.0.1", port: int = 0, framing: Framing = "rtu"
) -> Iterator[str]:
    """Serve a device until the block ends; yield its address as `host:port`.

    Args:
        device: what answers.
        host: interface to listen on.
        port: 0 takes a free one.
        framing: of a Modbus device: RTU frames, as a serial bridge passes them on, or Modbus TCP.

    Raises:
        InputError: when the port is taken.
    """
    try:
        listener = socket.create_server((host, port))
    except OSError as error:
        raise InputError(
            f"{host}:{port}: no simulated supply can listen there ({error}); give another port"
        ) from None
    stop, stopper = socket.socketpair()
    thread = threading.Thread(
        target=_accept, args=(listener, device, framing, stop), name="simulated supply"
    )
    thread.start()
    try:
        yield f"{host}:{listener.getsockname()[1]}"
    finally:
        stopper.send(b"!")  # read by nobody: each thread sees it
        thread.join()
        stopper.close()
        stop.close()


@contextmanager
def serve_terminal(device: SimulatedSupply) -> Iterator[str]:
    """Serve a device on a pseudo terminal until the block ends; yield the port's name.

    Raises:
        InputError: where there are no pseudo terminals.
    """
    if sys.platform == "win32":
        raise InputError("there are no pseudo terminals here; serve on TCP")
    import tty

    ours, theirs = os.openpty()
    tty.setraw(theirs)  # held open, so that a client may come and go
    stop, stopper = socket.socketpair()
    thread = threading.Thread(
        target=_converse,
        args=(device, device.wire("rtu"), ours, lambda data: os.write(ours, data), stop),
        name="simulated supply",
    )
    thread.start()
    try:
        yield os.ttyname(theirs)
    finally:
        stopper.send(b"!")  # read by nobody: each thread sees it
        thread.join()
        stopper.close()
        stop.close()
        os.close(ours)
        os.close(theirs)


def _accept(
    listener: socket.socket, device: SimulatedSupply, framing: Framing, stop: socket.socket
) -> None:
    clients: list[threading.Thread] = []
    with listener:
        while stop not in select.select([listener, stop], [], [])[0]:
            link, _ = listener.accept()
            thread = threading.Thread(
                target=_attend, args=(link, device, framing, stop), name="simulated supply's client"
            )
            thread.start()
            clients.append(thread)
    for thread in clients:
        thread.join()


def _attend(
    link: socket.socket, device: SimulatedSupply, framing: Framing, stop: socket.socket
) -> None:
    with link:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        _converse(device, device.wire(framing), link, link.sendall, stop)


def _converse(
    device: SimulatedSupply,
    wire: Wire,
    source: socket.socket | int,
    send: Callable[[bytes], object],
    stop: socket.socket,
) -> None:
    """Pass bytes until something comes from `stop`, the client hangs up, or a cable is pulled."""
    by_socket = isinstance(source, socket.socket)
    while not (by_socket and device.unplugged):
        ready, _, _ = select.select([source, stop], [], [], POLL_S if by_socket else None)
        if stop in ready:
            return
        if not ready:
            continue
        try:
            data = source.recv(CHUNK) if by_socket else os.read(source, CHUNK)
            if not data:
                return
            if device.unplugged:
                continue
            for answer in wire.receive(data):
                # one answer after the other, as a serial device: the next request waits
                time.sleep(answer.delay_s)
                send(answer.data)
        except OSError:
            return
