"""`workbench runs`: the bundles on disk."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from workbench.bundle import Bundle, verify
from workbench.cli.output import JsonFlag, RunsFolder, comparison_table, emit, show_table
from workbench.cli.run import describe

__all__ = ["runs"]

runs = typer.Typer(name="runs", help="List, show and verify bundles.", no_args_is_help=True)


@runs.command("list")
def list_runs(folder: RunsFolder = Path("runs"), as_json: JsonFlag = False) -> None:
    """List the bundles, newest last.

    Example: workbench runs list
    """
    found = [Bundle.open(path.parent) for path in sorted(folder.glob("*/manifest.json"))]
    if as_json:
        emit({"runs": [describe(bundle) for bundle in found]})
        return
    rows = [
        [b.path.name, b.manifest["status"], b.manifest["mode"], _distance(b, "real"),
         _distance(b, "twin"), b.manifest["title"]]
        for b in found
    ]  # fmt: skip
    show_table(str(folder), ["bundle", "status", "mode", "real [m]", "twin [m]", "title"], rows)


@runs.command()
def show(
    run: Annotated[Path, typer.Argument(help="Bundle: its folder or name.")],
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Show one bundle's manifest, and real against twin.

    Example: workbench runs show runs/2026-03-12_101500_hop-16.99
    """
    bundle = Bundle.find(run, folder)
    if as_json:
        emit(bundle.manifest | {"bundle": str(bundle.path)})
        return
    if "real" in bundle.manifest:
        comparison_table(bundle.manifest)
    rows = [
        [key, str(value)]
        for key, value in (bundle.manifest | {"output_off": bundle.output_off}).items()
        if not isinstance(value, (dict, list))
    ]
    show_table(bundle.path.name, ["", ""], rows)


@runs.command("verify")
def verify_runs(
    paths: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Bundles: folders or names.")
    ],
    folder: RunsFolder = Path("runs"),
    as_json: JsonFlag = False,
) -> None:
    """Check every checksum; exit code 1 when a file is missing, changed or unknown.

    Example: workbench runs verify runs/2026-03-12_101500_hop-16.99
    """
    problems = {str(path): verify(Bundle.find(path, folder).path) for path in paths}
    bad = any(problems.values())
    if as_json:
        emit({"ok": not bad, "problems": problems})
    else:
        for path, found in problems.items():
            print(f"{path}: {'ok' if not found else ''}")
            for problem in found:
                print(f"  {problem}")
    if bad:
        raise typer.Exit(1)


def _distance(bundle: Bundle, who: str) -> str:
    found = bundle.manifest.get(who)
    if not isinstance(found, dict) or "distance_m" not in found:
        return "-"
    return f"{found['distance_m']:.3f}"
