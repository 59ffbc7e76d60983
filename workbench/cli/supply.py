"""`workbench supply`: the motor's supply by hand."""

from __future__ import annotations

import math
import sys
import threading
from contextlib import suppress
from dataclasses import asdict
from typing import Annotated

import typer
from serial.tools.list_ports import comports

from workbench.cli.completion import bench_names
from workbench.cli.console import fact_rows, progress, show_table, stderr
from workbench.cli.plain_output import JsonFlag, emit
from workbench.errors import HardwareError, InputError, SafetyStop
from workbench.hw import (
    FAMILIES,
    MODELS,
    Family,
    ModbusModel,
    Model,
    ScpiModel,
    SimulatedSupply,
    SystemClock,
    delayed_fault,
    draw_current,
    model_named,
    obey,
    serve,
    serve_terminal,
    simulated_supply,
)
from workbench.output import BY_HAND, MAY_BE_ON
from workbench.run import (
    RealBench,
    acknowledged,
    drive,
    load_bench,
    make_bench,
    opened,
    switch_off,
    who_is_at,
)
from workbench.schemas import parse_quantity
from workbench.signals import Signals

__all__ = ["supply"]

POLL_S = 0.1
_SERVED_AT = "127.0.0.1:5020"
FAMILY_NAMES = ", ".join(FAMILIES)

supply = typer.Typer(name="supply", help="The motor's supply by hand.", no_args_is_help=True)

BenchOption = Annotated[
    str,
    typer.Option("--bench", help="Bench file that names the supply.", autocompletion=bench_names),
]

VoltsArgument = Annotated[str, typer.Argument(metavar="VOLTAGE", help="Such as '2.5 V'.")]
AmpsOption = Annotated[
    str, typer.Option("--current", help="Current limit, such as '0.8 A'; the bench's if left out.")
]
SecondsOption = Annotated[
    str, typer.Option("--for", help="Such as '10 s'; until Ctrl-C when left out.")
]


@supply.command()
def models(as_json: JsonFlag = False) -> None:
    """List the supplies that are known.

    Example: workbench supply models
    """
    if as_json:
        emit({"models": [_facts(model) for model in MODELS]})
        return
    rows = [
        [m.name, m.family, f"{m.voltage_max_V} V, {m.current_max_A} A", f"{m.voltage_step_V} V",
         str(m.baud), m.on_lost_link.partition(":")[0]] for m in MODELS
    ]  # fmt: skip
    show_table("Supplies", ["model", "family", "up to", "step", "baud", "when the link dies"], rows)


def _facts(model: Model) -> dict[str, object]:
    facts: dict[str, object] = {
        "name": model.name,
        "also": list(model.also),
        "family": model.family,
        "voltage_max_V": float(model.voltage_max_V),
        "current_max_A": float(model.current_max_A),
        "voltage_step_V": float(model.voltage_step_V),
        "current_steps_A": [float(step) for step in model.current_steps_A],
        "baud": model.baud,
        "on_lost_link": model.on_lost_link,
        "quirks": list(model.quirks),
        "source": model.source,
    }
    if isinstance(model, ModbusModel):
        return facts | {"ids": list(model.ids)}
    facts |= {"pattern": model.identity}
    if not isinstance(model, ScpiModel):
        return facts
    ratings = [rating._asdict() for rating in model.ratings]
    return facts | {"channels": [{k: float(v) for k, v in own.items()} for own in ratings]}


@supply.command()
def probe(
    port: Annotated[str, typer.Option(help="Serial port, or host:port.")] = "",
    family: Annotated[str, typer.Option(help=f"Try this family only: {FAMILY_NAMES}.")] = "",
    rtu_over_tcp: Annotated[
        bool, typer.Option(help="A host:port passes RTU frames on, as a serial bridge does.")
    ] = False,
    as_json: JsonFlag = False,
) -> None:
    """Find out which supply is at a port; sets nothing.

    Without a port every serial port of this computer is tried.

    Example: workbench supply probe --port 127.0.0.1:5020
    """
    if family and family not in FAMILIES:
        raise InputError(f"no supply family {family!r}; there are {FAMILY_NAMES}")
    ports = [port] if port else [found.device for found in comports()]
    families: list[Family] = [known for known in FAMILIES if family in ("", known)]
    found = [who for one in ports if (who := who_is_at(one, families, rtu_over_tcp))]
    if not found:
        raise HardwareError(
            f"no supply of {', '.join(families)} answers at {', '.join(ports) or 'any port'}; "
            "is it on, its interface enabled, and no other program holding the port?"
        )
    if as_json:
        emit({"supplies": found})
        return
    columns = ["port", "family", "model", "serial", "firmware", "baud"]
    show_table("Supplies", columns, [[str(who[name]) for name in columns] for who in found])


@supply.command()
def read(bench: BenchOption, as_json: JsonFlag = False) -> None:
    """Read who the supply is and its state; changes nothing.

    Example: workbench supply read --bench lab.yaml
    """
    with opened(_real(bench)) as device:
        found = device.identify()._asdict() | asdict(device.measure())
    if as_json:
        emit(found)
    else:
        del found["time_s"]  # of this computer's clock since it was started
        show_table(bench, ["", ""], fact_rows(found))


@supply.command(name="set")
def set_voltage(
    volts: VoltsArgument,
    bench: BenchOption,
    amps: AmpsOption = "",
    seconds: SecondsOption = "",
    as_json: JsonFlag = False,
) -> None:
    """Drive a voltage by hand, within the bench's limits and watched as a run is.

    The output is off again at the end, at Ctrl-C, and when this program dies.

    Example: workbench supply set "2.5 V" --bench lab.yaml --for "10 s"
    """
    reading = drive(
        _real(bench),
        _typed(volts, "voltage"),
        _typed(seconds, "time") if seconds else math.inf,
        progress,
        progress.update,
        _typed(amps, "current") if amps else None,
    )
    if reading is not None:
        stderr.print(f"{reading.voltage_V:.2f} V, {reading.current_A:.3f} A", markup=False)
    if as_json and reading is not None:
        emit(asdict(reading) | {"output": False})
    else:
        print("output off, confirmed")


def _typed(text: str, dimension: str) -> float:
    try:
        return parse_quantity(text, dimension, typed=True)[0]
    except ValueError as fault:
        raise InputError(str(fault)) from None


@supply.command()
def off(bench: BenchOption) -> None:
    """Switch the output off and confirm it, whoever drives it.

    A run that drives it is asked to stop first, through its guardian.

    Example: workbench supply off --bench lab.yaml
    """
    with Signals() as signals:
        signals.hold()  # an impatient Ctrl-C would keep the output on
        dead = switch_off(_real(bench))
    if not dead:
        raise SafetyStop(f"{bench}: {MAY_BE_ON}, {BY_HAND}")
    print("output off, confirmed")


@supply.command()
def acknowledge(
    bench: BenchOption, name: Annotated[str, typer.Option(help="Who has looked at the cause.")]
) -> None:
    """Sign for a safety stop, so that the next run may drive the supply.

    Example: workbench supply acknowledge --bench lab.yaml --name NAME
    """
    for stop in acknowledged(_real(bench), bench, name, _warn):
        print(f"acknowledged by {name}: {stop.reason}")


def _warn(text: str) -> None:
    stderr.print(text, markup=False)


@supply.command()
def simulate(
    family: Annotated[str, typer.Argument(help=f"Supply family: {FAMILY_NAMES}.")] = "riden",
    model: Annotated[str, typer.Option(help="Model name; the family's first when left out.")] = "",
    tcp: Annotated[str, typer.Option(help="host:port to serve on.")] = _SERVED_AT,
    rtu_over_tcp: Annotated[bool, typer.Option(help="RTU frames instead of Modbus TCP.")] = False,
    pty: Annotated[bool, typer.Option(help="Serve on a pseudo terminal instead.")] = False,
    fault: Annotated[str, typer.Option(help="NAME or NAME:SECONDS: what is to go wrong.")] = "",
) -> None:
    """Serve a simulated supply that answers the real bytes, until Ctrl-C or `end`.

    Lines on its standard input switch faults while it runs; `help` lists them.

    Example: workbench supply simulate riden --model RD6006 --tcp 127.0.0.1:5020 --fault silent:5
    """
    row = _row(family, model)
    coming, after = delayed_fault(fault) if fault else (None, 0.0)
    host, _, port = tcp.rpartition(":")
    if not host or not port.isdecimal():
        raise InputError(f"--tcp {tcp!r} is not host:port; write for example {_SERVED_AT}")
    clock = SystemClock()
    device = simulated_supply(row.name, clock=clock, load=draw_current)
    ended = threading.Event()
    threading.Thread(target=_read_commands, args=(device, ended), daemon=True).start()
    began = clock.now()
    while not ended.is_set():
        framing = "rtu" if rtu_over_tcp else "tcp"
        served = serve_terminal(device) if pty else serve(device, host, int(port), framing)
        with served as address:
            stderr.print(f"simulated {row.name} on {address}, Ctrl-C ends it", markup=False)
            while not ended.wait(POLL_S) and not (pty and device.unplugged):
                if coming is not None and clock.now() - began >= after:
                    stderr.print(obey(device, coming), markup=False)
                    coming = None
        while pty and device.unplugged and not ended.wait(POLL_S):
            pass


def _row(family: str, model: str) -> Model:
    rows = [row for row in MODELS if row.family == family]
    if not rows:
        raise InputError(f"no simulated supply {family!r}; there are {FAMILY_NAMES}")
    found = model_named(model) if model else rows[0]
    if found.family != family:
        raise InputError(f"{model} is of family {found.family}, not {family}")
    return found


def _read_commands(device: SimulatedSupply, ended: threading.Event) -> None:
    """Carry out the lines of standard input; the end of the input ends nothing."""
    with suppress(OSError, ValueError):  # no standard input, or closed
        for line in sys.stdin:
            if line.strip() == "end":
                ended.set()
                return
            try:
                stderr.print(obey(device, line), markup=False)
            except InputError as error:
                stderr.print(str(error), markup=False)


def _real(bench: str) -> RealBench:
    """Return a bench with a real supply."""
    device = make_bench(load_bench(bench).content)
    if not isinstance(device, RealBench):
        raise InputError(f"bench {bench!r} has no real supply; see `workbench supply simulate`")
    return device
