"""`workbench runs diff`: what two runs differ in."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from workbench.bundle import Bundle, run_named
from workbench.catalogue import ABSENT, Difference, differences
from workbench.cli.plain_output import (
    JsonFlag,
    RunArgument,
    RunsFolder,
    emit,
    print_columns,
    print_to_stderr,
)

__all__ = ["diff"]


def diff(
    a: RunArgument, b: RunArgument, folder: RunsFolder = Path("runs"), as_json: JsonFlag = False
) -> None:
    """Show what two runs differ in: what was asked, protocol, model, shape, bench, results.

    Only what differs is shown. A list of named things goes by their names, others by number.

    Example: workbench runs diff 17 18
    """
    first, second = (Bundle.open(run_named(one, folder)) for one in (a, b))
    found = differences(first, second)
    if as_json:
        listed = [one.as_json() for one in found]
        emit({"a": first.path.name, "b": second.path.name, "differences": listed})
        return
    print(f"a  {first.path.name}\nb  {second.path.name}")
    for section, group in groupby(found, key=lambda one: one.section):
        print()
        rows = [[_name(one), _shown(one.a), _shown(one.b), _b_minus_a(one)] for one in group]
        print_columns([section, "a", "b", ""], rows)
    if not found:
        print_to_stderr("nothing differs")


def _name(one: Difference) -> str:
    return f"{one.path} [{one.unit}]" if one.unit else one.path


def _shown(value: object) -> str:
    if value is ABSENT:
        return "(absent)"
    return f"{value:.6g}" if isinstance(value, float) else " ".join(str(value).split())


def _b_minus_a(one: Difference) -> str:
    if isinstance(one.a, (int, float)) and isinstance(one.b, (int, float)):
        return "" if isinstance(one.a, bool) else f"{one.b - one.a:+.4g}"
    return ""
