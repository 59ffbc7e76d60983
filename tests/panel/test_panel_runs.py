"""The pages of all runs, in a real browser: ten thousand rows, comparison and trends."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

from tests.bundles import NOW, make_bundle
from tests.panel.chromium import Browser
from workbench.bundle import bundle_names
from workbench.catalogue import Query, search
from workbench.catalogue.entry import COLUMNS, as_row
from workbench.catalogue.index import _STAMPED, INDEX, _changed, _insert, _opened
from workbench.errors import InputError
from workbench.panel import Panel, Protocols, Starter, Watcher
from workbench.panel.runs import compare_page, trend_page

MANY = 10_000
BAR_S = 0.3


def served(root: Path, empty: Path) -> Iterator[Panel]:
    """Serve the pages of a folder without the panel's own watching of it."""
    watcher = Watcher(empty)
    watcher.runs = root
    panel = Panel(watcher, Starter(Protocols(empty, "virtual"), root))
    thread = threading.Thread(target=panel.serve)
    thread.start()
    yield panel
    panel.stop()
    thread.join(10)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twelve runs of one condition, the last out of control."""
    root = tmp_path_factory.mktemp("lab") / "runs"
    errors = [5.0, 5.4, 5.1, 5.3, 5.0, 5.5, 5.2, 5.1, 5.4, 5.2, 5.3, 9.0]
    for k, error in enumerate(errors):
        make_bundle(root, f"r{k:02}", NOW + k * timedelta(days=1), error_mm=error)
    return root


@pytest.fixture
def few(lab: Path, tmp_path: Path) -> Iterator[Panel]:
    yield from served(lab, tmp_path)


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Panel]:
    """Ten thousand folders whose rows are put straight into the index."""
    folder = tmp_path_factory.mktemp("many")
    first = make_bundle(folder / "runs", "first")
    manifest = (first.path / "manifest.json").read_bytes()
    (entry,) = search(folder / "runs", Query(), pytest.fail).entries
    rng = np.random.default_rng(1)
    rows = []
    for k in range(1, MANY):
        path = folder / "runs" / f"2026-03-13_{k // 100:06}_hop-{k:05}"
        path.mkdir()
        (path / "manifest.json").write_bytes(manifest)
        rows.append(as_row(replace(
            entry, name=path.name, title=f"Hop number {k}", error=float(rng.gamma(4)),
            mode=("hop", "clamped", "decay")[k % 3], created=f"2026-03-13T10:{k % 60:02}:00",
        )))  # fmt: skip
    names = bundle_names(folder / "runs")
    stamps = _changed(folder / "runs", names, {})
    with closing(_opened(str(folder / "runs" / INDEX), pytest.fail)) as base:
        base.execute("BEGIN IMMEDIATE")
        base.executemany(_insert("runs", COLUMNS), rows)
        base.executemany(_insert("stamps", _STAMPED), [(name, *now) for name, now in stamps])
        base.execute("COMMIT")
    yield from served(folder / "runs", folder / "empty")


SECONDS = """(async () => {
  const painted = () => new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  const began = performance.now();
  %s
  document.body.getBoundingClientRect();
  await painted();
  return (performance.now() - began) / 1000;
})()"""


@pytest.mark.xdist_group("alone")
@pytest.mark.budget(40)  # ten thousand folders are made, and a browser reads them
def test_ten_thousand_runs_are_listed_sorted_and_filtered_at_once(
    browser: Browser, many: Panel
) -> None:
    page = browser.open(f"{many.url}list")
    page.wait_for("document.querySelectorAll('#rows tr').length > 0")
    assert page.text("#count") == str(MANY)
    steps = {
        "listed": "choose();",
        "sorted": "document.querySelector('[data-field=error]').click();",
        "filtered": "at('filter').value = 'hop error>8 mode=clamped'; choose();",
    }
    took = {}
    for what, script in steps.items():
        took[what] = min(page.evaluate(SECONDS % script) for _ in range(3))
    print(took)
    assert max(took.values()) < BAR_S, took
    shown, every = map(int, page.text("#count").split(" of "))
    assert 0 < shown < every == MANY
    values = page.evaluate("wanted.map((k) => rows[k][place('error')])")
    assert len(values) == shown
    assert min(values) > 8
    assert values in (sorted(values), sorted(values, reverse=True))
    assert page.complaints() == []
    page.close()


def test_rows_are_filtered_sorted_and_their_columns_chosen(browser: Browser, few: Panel) -> None:
    page = browser.open(f"{few.url}list")
    page.wait_for("document.querySelectorAll('#rows tr').length === 12")
    page.click("[data-field=error]")
    assert "9.0" in page.text("#rows tr")
    page.click("#filter")
    page.type("error<5.05")
    page.wait_for("document.querySelectorAll('#rows tr').length === 2")
    page.evaluate("at('filter').value = 'eror>5'; choose()")
    assert "There is no column “eror”; columns are name, created" in page.text("#refused")
    page.evaluate("at('filter').value = 'error>x'; choose()")
    assert page.text("#refused") == "“x” is no number: write error>17."
    assert "Noise" not in page.text("#heads")
    page.evaluate("document.querySelector('[data-column=noise]').click()")
    assert "Noise [mm]" in page.text("#heads")
    page.evaluate("at('filter').value = ''; choose()")
    for box in (1, 2):
        page.click(f"#rows tr:nth-child({box}) input")
    assert page.text("#compare") == "Compare 2"
    page.click("#compare")
    page.wait_for("document.querySelectorAll('path.curve').length > 1")
    assert page.text("h1") == "2 runs compared"
    assert page.complaints() == []
    assert all(one.startswith(few.url) for one in page.requests())
    page.close()


def test_runs_beside_each_other_show_measured_and_twin(lab: Path) -> None:
    names = bundle_names(lab)[:2]
    text = compare_page(lab, names)
    for k in range(2):
        for style in ("measured", "twin"):
            assert f'class="curve run{k} {style}"' in text
    assert "<td>0.213</td>" in text
    with pytest.raises(InputError, match=r"no run '\.\./x'"):
        compare_page(lab, ["../x"])
    with pytest.raises(InputError, match="choose 1 to 6 runs"):
        compare_page(lab, bundle_names(lab)[:7])


def test_a_trend_tells_the_run_that_is_out_of_control(lab: Path) -> None:
    text = trend_page(lab)
    last = bundle_names(lab)[-1]
    assert f"Error of the twin [mm]: OUT OF CONTROL in 1 of 12 runs, first {last}" in text
    assert "Distance [m]: in control" in text
    with pytest.raises(InputError, match="no run 'none'"):
        trend_page(lab, "none")


@pytest.mark.parametrize("path", ["list", "trend"])
def test_pages_fit_a_phone(browser: Browser, few: Panel, path: str) -> None:
    page = browser.open(f"{few.url}{path}", width=420)
    page.wait_for("document.querySelectorAll('#rows tr, circle').length > 11")
    assert page.evaluate("document.documentElement.scrollWidth") <= 420
    assert page.complaints() == []
    page.close()
