"""Two tiers of tests, what a test of the first may cost, and which tests run side by side.

`make test` runs the first tier: all that is not marked `long`. A test of it that costs more than
its budget is named, so that the tier stays quick, and fails the run where it is more by half: so
much the same test differs between computers, and by what was compiled or made by tests before it
(one that passed within 12 s took 19 s on another computer). The ten slowest are printed. Cost is
processor time, of the test and of the processes it started, as that hardly depends on what else the
computer does; waiting has a budget of its own, which a busy computer hardly reaches.

Linear algebra uses one thread: its small matrices gain nothing from more, and threads that wait for
each other use up the cores of the other workers. Set before numpy loads, for processes as well.
Garbage in cycles is looked for less often than usual, as thousands of tests and modules stay.

Workers get one module at a time, as its tests share fixtures, unless `xdist_group` says otherwise.
The group `alone` holds what watches the clock or kills. It comes first: it mostly waits, and while
one worker does that the others have the cores.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Generator, Iterable
from typing import NamedTuple, cast

import pytest

__all__ = ["BUDGET_S", "WAIT_S", "Costs"]

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
gc.set_threshold(10_000)

BUDGET_S = 12.0
"""Processor time that a test of the first tier may take [s], with the fixtures that it builds."""
WAIT_S = 60.0
"""How long it may take on a busy computer, where it mostly waits [s]."""

SPREAD = 1.5
"""Times its budget from which a test fails the run."""

_SHOWN = 10
_COST = "cost"
_ALONE = "alone"


class Cost(NamedTuple):
    """What a test cost, all its phases together.

    Args:
        processor_s: of the test and the processes that it started and awaited [s].
        wall_s: from its begin to its end [s].
    """

    processor_s: float
    wall_s: float


class Costs:
    """Collects what tests cost, where the results of all workers arrive.

    `spent` is test -> cost, `budgets` test -> processor time that it may take [s], in the first
    tier, and `total_s` the processor time of all.
    """

    def __init__(self) -> None:
        self.spent: dict[str, Cost] = {}
        self.budgets: dict[str, float] = {}
        self.total_s = 0.0

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Add one phase of one test; what ends with a module's fixtures is charged to no test."""
        for name, value in report.user_properties:
            if name != _COST:
                continue
            processor_s, budget = cast("tuple[float, float | None]", value)
            self.total_s += processor_s
            if report.when == "teardown":
                continue
            before = self.spent.get(report.nodeid, Cost(0.0, 0.0))
            self.spent[report.nodeid] = Cost(
                before.processor_s + processor_s, before.wall_s + report.duration
            )
            if budget is not None:
                self.budgets[report.nodeid] = budget

    def over(self, spread: float = 1.0) -> dict[str, str]:
        """Return the tests that cost more than they may -> by what.

        Args:
            spread: times the budget that a test may cost.
        """
        found = {}
        for test, budget in self.budgets.items():
            processor_s, wall_s = self.spent[test]
            if processor_s > spread * budget:
                found[test] = f"{processor_s:.1f} s of processor time, {budget:g} s are allowed"
            elif wall_s > spread * WAIT_S * budget / BUDGET_S:
                allowed = WAIT_S * budget / BUDGET_S
                found[test] = f"took {wall_s:.0f} s, {allowed:g} s are allowed"
        return found

    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        """Fail a run whose tests cost too much."""
        if self.over(SPREAD) and exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Print the slowest tests, the sum, and what costs too much."""
        if not self.spent:
            return
        terminalreporter.section("cost")
        slowest = sorted(self.spent.items(), key=lambda one: -one[1].processor_s)[:_SHOWN]
        for test, (processor_s, wall_s) in slowest:
            terminalreporter.line(f"{processor_s:6.1f} s of processor, {wall_s:6.1f} s: {test}")
        terminalreporter.line(f"{self.total_s:6.0f} s of processor in all {len(self.spent)} tests")
        for test, why in self.over().items():
            terminalreporter.line(f"too slow for the first tier: {test}: {why}", red=True)
        if self.over():
            terminalreporter.line("make it cheaper, or mark it `long` (CONTRIBUTING.md, Tests)")


def pytest_configure(config: pytest.Config) -> None:
    """Collect costs, where this is no worker."""
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Costs(), "costs")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Keep the tests of a module on one worker; begin with what runs alone, then what is long."""
    for item in items:
        if item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group(item.nodeid.split("::")[0]))
    items.sort(key=lambda item: (_ALONE not in _groups(item), -_budget_s(item)))


def _groups(item: pytest.Item) -> Iterable[str]:
    return [
        mark.args[0] if mark.args else mark.kwargs["name"]
        for mark in item.iter_markers("xdist_group")
    ]


def _budget_s(item: pytest.Item) -> float:
    mark = item.get_closest_marker("budget")
    return BUDGET_S if mark is None else float(mark.args[0])


_before = pytest.StashKey[float]()


@pytest.hookimpl(tryfirst=True, wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None]:
    """Remember the processor time before, and let a timed test go first on a busy machine."""
    if hasattr(os, "SCHED_BATCH"):  # Linux: a batch process does not keep one that wakes waiting
        group = item.get_closest_marker("xdist_group")
        timed = group is not None and group.args == ("alone",)
        policy = os.SCHED_OTHER if timed else os.SCHED_BATCH
        os.sched_setscheduler(0, policy, os.sched_param(0))
    item.stash[_before] = _processor_s()
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Let the report of each phase say what it cost, and what the test may cost."""
    report = yield
    now = _processor_s()
    spent, item.stash[_before] = now - item.stash.get(_before, now), now
    budget = _budget_s(item) if item.get_closest_marker("long") is None else None
    report.user_properties.append((_COST, (spent, budget)))
    return report


def _processor_s() -> float:
    """Return the processor time of this process and of those that it awaited [s]."""
    return sum(os.times()[:4])
