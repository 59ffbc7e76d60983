"""`workbench supply`: the motor's supply by hand."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from workbench.bench import RealBench, load_bench, make_bench
from workbench.cli.output import JsonFlag, RunsFolder, emit, people, show_table
from workbench.errors import InputError, SafetyStop
from workbench.hw import MODELS, Supply, SystemClock
from workbench.hw.simulated import SimulatedRiden, serve

__all__ = ["supply"]

supply = typer.Typer(name="supply", help="The motor's supply by hand.", no_args_is_help=True)

BenchOption = Annotated[str, typer.Option("--bench", help="Bench file that names the supply.")]


@supply.command()
def models(as_json: JsonFlag = False) -> None:
    """List the supplies that are known.

    Example: workbench supply models
    """
    if as_json:
        emit({"models": [
            {"name": m.name, "family": m.family, "first_id": m.ids[0], "last_id": m.ids[-1],
             "voltage_max_V": float(m.voltage_max_V), "current_max_A": float(m.current_max_A),
             "voltage_step_V": float(m.voltage_step_V)} for m in MODELS
        ]})  # fmt: skip
        return
    rows = [
        [m.name, m.family, f"{m.ids[0]}-{m.ids[-1]}", f"{m.voltage_max_V} V, {m.current_max_A} A",
         f"{m.voltage_step_V} V"] for m in MODELS
    ]  # fmt: skip
    show_table("Supplies", ["model", "family", "model ids", "up to", "step"], rows)


@supply.command()
def read(bench: BenchOption, as_json: JsonFlag = False) -> None:
    """Read who the supply is and its state; changes nothing.

    Example: workbench supply read --bench lab.yaml
    """
    with _opened(bench) as device:
        found = device.identify()._asdict() | asdict(device.measure())
    if as_json:
        emit(found)
    else:
        show_table(bench, ["", ""], [[key, str(value)] for key, value in found.items()])


@supply.command()
def off(bench: BenchOption) -> None:
    """Switch the output off and confirm it.

    Example: workbench supply off --bench lab.yaml
    """
    with _opened(bench) as device:
        confirmed = device.off()
        dead = confirmed and device.terminals_dead()
    if not dead:
        raise SafetyStop(f"{bench}: OUTPUT MAY BE ON, switch it off by hand")
    print("output off, confirmed")


@supply.command()
def acknowledge(
    bench: BenchOption,
    name: Annotated[str, typer.Option(help="Who has looked at the cause.")],
    runs: RunsFolder = Path("runs"),
) -> None:
    """Release the latch that a safety stop has left, so that the next run may drive.

    Example: workbench supply acknowledge --bench lab.yaml --name "A. Weber"
    """
    latch = make_bench(load_bench(bench).content).latch(runs)
    if latch is None:
        raise InputError(f"bench {bench!r} has no real supply, so nothing is ever latched")
    trip = latch.acknowledge(name)
    print(f"acknowledged by {name}: {trip.reason}")


@supply.command()
def simulate(
    family: Annotated[str, typer.Argument(help="Supply family: riden.")] = "riden",
    model: Annotated[str, typer.Option(help="Model name.")] = "RD6006",
    tcp: Annotated[str, typer.Option(help="host:port to serve on.")] = "127.0.0.1:5020",
    rtu_over_tcp: Annotated[bool, typer.Option(help="RTU frames instead of Modbus TCP.")] = False,
) -> None:
    """Serve a simulated supply that answers the real bytes, until Ctrl-C.

    Example: workbench supply simulate riden --model RD6006 --tcp 127.0.0.1:5020
    """
    if family != "riden":
        raise InputError(f"no simulated supply {family!r}; there is riden")
    host, _, port = tcp.rpartition(":")
    if not host or not port.isdecimal():
        raise InputError(f"{tcp!r} is not host:port")
    device = SimulatedRiden(clock=SystemClock(), model=model)
    framing = "rtu" if rtu_over_tcp else "tcp"
    with serve(device, host=host, port=int(port), framing=framing) as address:
        people.print(f"simulated {model} on {address}, Ctrl-C ends it", markup=False)
        while True:
            time.sleep(0.5)


@contextmanager
def _opened(bench: str) -> Iterator[Supply]:
    """Open a real bench's supply without touching its output."""
    device = make_bench(load_bench(bench).content)
    if not isinstance(device, RealBench):
        raise InputError(f"bench {bench!r} has no real supply; see `workbench supply simulate`")
    found = device.open_supply()
    try:
        yield found
    finally:
        found.close()
