"""`workbench panel`: the page beside a run."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.completion import bench_names
from workbench.cli.console import progress, stderr
from workbench.cli.plain_output import JsonFlag, RunsFolder, emit

__all__ = ["panel"]


def panel(
    folder: Annotated[
        Path, typer.Argument(help="Folder of the protocols that may be started from the page.")
    ] = Path("protocols"),
    bench: Annotated[
        str,
        typer.Option(
            help="Bench file that they are started on, or `virtual`.", autocompletion=bench_names
        ),
    ] = "virtual",
    runs: RunsFolder = Path("runs"),
    port: Annotated[
        int, typer.Option(help="Port on 127.0.0.1; 0 takes a free one.", min=0, max=65535)
    ] = 0,
    as_json: JsonFlag = False,
) -> None:
    """Serve a page that starts runs of a folder of protocols, shows, answers and stops them.

    Open the address that is printed, in a browser on this computer; whoever knows it can start and
    stop runs. A run of a terminal is shown too: start the panel before it or during it, and close
    it at any time with Ctrl-C. Ctrl-C also stops a run that was started from the page, as in that
    run's terminal. The panel is no safety device: keep a switch within reach.

    Example: workbench panel --bench lab.yaml

    Example: workbench panel protocols --runs runs --port 8100
    """
    from workbench.panel import Panel, Protocols, Starter, Watcher  # not for --help

    starter = Starter(Protocols(folder, bench), runs)
    with Watcher(runs, starter.facts_of) as watcher:
        served = Panel(watcher, starter, port)
        if as_json:
            emit({"url": served.url, "port": served.port, "pid": os.getpid()})
            sys.stdout.flush()  # whoever started it in a pipe waits for the address
        else:
            print(f"panel: {served.url}", flush=True)
            stderr.print("It is no safety device: keep a switch within reach. Ctrl-C closes it.")
        try:
            served.serve()
        except KeyboardInterrupt:
            stopping = "stopping the run that was started from it"
            try:
                progress(
                    f"panel closed; {stopping if starter.alive else 'a run goes on without it'}"
                )
            finally:  # also where the terminal is closed, and nothing can be printed
                starter.close()
