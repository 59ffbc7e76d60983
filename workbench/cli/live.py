"""`workbench live`: record Motive's stream into an export."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.console import progress
from workbench.cli.number_option import number
from workbench.cli.plain_output import JsonFlag, emit
from workbench.cli.quality import print_quality
from workbench.errors import InputError
from workbench.tracking import Recorder, Stream, Take, guess_bodies, quality, write_motive

__all__ = ["live"]

DEFAULT = Stream()
_DAY_S = 86400.0


def live(
    server: Annotated[str, typer.Option(help="Address of the tracking PC.")] = DEFAULT.server,
    seconds: Annotated[
        float | None,
        typer.Option(
            help="How long [s]; without it until Ctrl-C.", parser=number("time", "s", 0.1, _DAY_S)
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="New file for the take, in Motive's CSV format.")
    ] = None,
    local: Annotated[
        str | None, typer.Option(help="Address of this computer that reaches the server.")
    ] = None,
    multicast: Annotated[
        bool, typer.Option("--multicast", help="Motive's transmission type is multicast.")
    ] = False,
    command_port: Annotated[int, typer.Option(min=1, max=65535)] = DEFAULT.command_port,
    data_port: Annotated[
        int, typer.Option(help="Of a multicast stream.", min=1, max=65535)
    ] = DEFAULT.data_port,
    as_json: JsonFlag = False,
) -> None:
    """Record Motive's NatNet stream, report what came, and write it as an export with --out.

    Streaming has to be on in Motive, with Rigid Bodies and Labeled Markers. Nothing but the take is
    written; a take is never overwritten.

    Example: workbench live --server 192.168.1.10 --seconds 10 --out take.csv
    """
    if out is not None and out.exists():
        raise InputError(f"{out}: exists, and a take is never overwritten; give another --out")
    stream = replace(
        DEFAULT,
        server=server,
        local=local,
        multicast=multicast,
        command_port=command_port,
        data_port=data_port,
    )
    take = _record(stream, seconds)
    if out is not None:
        write_motive(take, out, version="1.24")
    report = quality(take)
    if as_json:
        emit(report | {"out": out})
    else:
        print_quality(str(stream), report, guess_bodies(take))


def _record(stream: Stream, seconds: float | None) -> Take:
    with Recorder(stream) as recorder:
        progress(f"recording {stream}" + ("; Ctrl-C ends it" if seconds is None else ""))
        try:
            time.sleep(_DAY_S if seconds is None else seconds)
        except KeyboardInterrupt:
            progress("stopped")
        return recorder.stop()
