"""`workbench panel`: the page beside a run."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from workbench.cli.output import JsonFlag, RunsFolder, emit, people, tell

__all__ = ["panel"]


def panel(
    folder: RunsFolder = Path("runs"),
    port: Annotated[
        int, typer.Option(help="Port on 127.0.0.1; 0 takes a free one.", min=0, max=65535)
    ] = 0,
    as_json: JsonFlag = False,
) -> None:
    """Serve a page that shows the run of this folder, answers its prompts and stops it.

    Open the address that is printed, in a browser on this computer; whoever knows it can stop runs.
    It is a program of its own: start it before a run or during one, close it at any time with
    Ctrl-C. It is no safety device: keep a switch within reach.

    Example: workbench panel

    Example: workbench panel --runs runs --port 8100
    """
    from workbench.panel import Panel, Watcher  # with the web server, which help needs not

    with Watcher(folder) as watcher:
        served = Panel(watcher, port)
        if as_json:
            emit({"url": served.url, "port": served.port, "pid": os.getpid()})
            sys.stdout.flush()  # whoever started it in a pipe waits for the address
        else:
            print(f"panel: {served.url}", flush=True)
            people.print("It is no safety device: keep a switch within reach. Ctrl-C closes it.")
        try:
            served.serve()
        except KeyboardInterrupt:
            tell("panel closed; a run goes on without it")
