"""What a bench file says of its supply: model, place, ledgers, and how it is made ready."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from workbench.errors import InputError, SafetyStop
from workbench.hw import (
    Connection,
    Limits,
    Model,
    Prepared,
    Reading,
    ScpiModel,
    Supply,
    check_scale,
    find_supply,
    model_named,
    prepare,
)
from workbench.output import Ledger, ledgers
from workbench.progress import Progress
from workbench.schemas import BenchFile

__all__ = [
    "check_new_scale",
    "connection_of",
    "found_at",
    "ledgers_of",
    "made_ready",
    "model_of",
    "require_not_latched",
]


def model_of(file: BenchFile) -> Model:
    """Return the row of the supply that a bench file names.

    Raises:
        InputError: when there is none, or it is of another family than the file says, or has no
            such channel.
    """
    section, channel = file.supply, file.supply.connection.channel
    model = model_named(section.model)
    if section.family not in (None, model.family):
        raise InputError(
            f"bench {file.name!r}: supply {section.model} is of family {model.family}, "
            f"not {section.family}"
        )
    if isinstance(model, ScpiModel):
        return model.on_channel(channel)
    if channel != 1:
        raise InputError(f"bench {file.name!r}: {model.name} has one channel, not {channel}")
    return model


def connection_of(file: BenchFile) -> Connection:
    """Return how the supply is reached; the address is empty where it has to be looked for.

    Raises:
        InputError: when the bench has no real supply.
    """
    connection = file.supply.connection
    kind = connection.kind
    if kind == "simulated":  # the schema allows it only beside a section `virtual`
        raise InputError(f"bench {file.name!r} has no real supply")
    address = connection.port if kind == "serial" else connection.address
    return Connection(
        kind,
        address or "",
        baud=connection.baud or model_of(file).baud,
        unit=connection.unit,
        timeout_s=connection.timeout,
        gap_s=connection.gap,
        echo=connection.echo,
        channel=connection.channel,
    )


def found_at(file: BenchFile) -> Connection:
    """Return where the supply is; one without a port in the file is looked for.

    Raises:
        HardwareError: when it is at no port.
    """
    connection, serial = connection_of(file), file.supply.serial_number
    if connection.address or serial is None:
        return connection
    model = model_of(file)
    return find_supply(connection, model.family, model.name, serial)


def ledgers_of(file: BenchFile) -> list[Ledger]:
    """Return the ledgers that may be of its supply: by serial number, or by where it was."""
    address = connection_of(file).resolved_address
    key = Ledger.key_of(model_of(file).name, file.supply.serial_number, address)
    return [one for one in ledgers() if one.key == key or (address and one.address == address)]


def made_ready(file: BenchFile, supply: Supply, limits: Limits) -> Prepared:
    """Prepare a supply as the one that a bench file names. Raises as `prepare`."""
    section = file.supply
    return prepare(supply, limits, model=section.model, serial=section.serial_number)


def check_new_scale(
    supply: Supply, ledger: Ledger | None, firmware: str, progress: Progress
) -> Reading | None:
    """Check the scale of a supply whose ledger does not know it, and keep that it was right.

    Args:
        supply: a prepared one.
        ledger: its own; None where there is nothing to harm.
        firmware: of the supply.
        progress: called before it is driven.

    Returns:
        what it measured; None where nothing had to be checked.

    Raises:
        SafetyStop: as `check_scale`.
    """
    if ledger is None or ledger.knows_scale(firmware):
        return None
    progress("check the supply's scale with 0.5 V")
    seen = check_scale(supply)
    ledger.write("scale", firmware=firmware, voltage_V=seen.voltage_V)
    return seen


def require_not_latched(ledgers: Iterable[Ledger], name: str, path: Path) -> None:
    """Refuse to drive a latched supply; its guardian does too, once it knows which it is.

    Args:
        ledgers: that may be of it.
        name: of its bench.
        path: of that bench's file.

    Raises:
        SafetyStop: when nobody acknowledged a safety stop of an earlier run.
    """
    for ledger in ledgers:
        if latch := ledger.latch():
            raise SafetyStop(
                f"bench {name!r} is {latch.description}\n"
                "nothing was switched on; find the cause, then type: workbench supply acknowledge "
                f"--bench {path} --name NAME"
            )
