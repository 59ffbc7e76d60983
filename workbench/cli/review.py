"""`workbench review`: open a run's recording in rerun."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import Bundle
from workbench.cli.output import RunsFolder, people
from workbench.errors import InputError
from workbench.review import open_viewer

__all__ = ["review"]


def review(
    run: Annotated[Path, typer.Argument(help="Bundle: its folder or name.")],
    web: Annotated[bool, typer.Option(help="Open in the browser instead of a window.")] = False,
    save: Annotated[Path | None, typer.Option(help="Copy the recording here instead.")] = None,
    runs: RunsFolder = Path("runs"),
) -> None:
    """Show the robot and its twin side by side.

    Example: workbench review runs/2026-03-12_101500_hop-16.99
    """
    recording = Bundle.find(run, runs).view("recording")
    if not recording.exists():
        raise InputError(f"{run}: has no recording; its status is in `workbench runs show {run}`")
    if save is not None:
        shutil.copyfile(recording, save)
        people.print(f"saved {save}", markup=False)
        return
    open_viewer(recording, web=web)
