"""What the journal says of an export, in words for the panel and the report."""

from __future__ import annotations

import pytest

from tests.conftest import ROOT
from workbench.bundle import Event, events, sentence
from workbench.run import load_bench, make_bench


@pytest.mark.parametrize(("event", "said"), [
    (events.TakeWanted(folder="exports"), "waiting for the export in exports"),
    (events.TakeWanted(), "waiting for the export to be named"),
    (events.TakeRefused(file="x/a.csv", reasons=("3 s long\nof 12",)),
     "export a.csv does not belong to this run: 3 s long"),
    (events.TakeForced(file="x/a.csv"),
     "export a.csv taken all the same, as the operator insisted"),
])  # fmt: skip
def test_an_export_is_spoken_of_in_words(event: Event, said: str) -> None:
    assert sentence(event) == said


def test_a_bench_says_what_a_run_waits_for() -> None:
    file = load_bench(str(ROOT / "docs" / "examples" / "lab-bench.yaml")).content
    assert make_bench(file).awaited == f"waiting for the export in {file.tracking.takes}"
    by_hand = file.tracking.model_copy(update={"takes": None})
    named = make_bench(file.model_copy(update={"tracking": by_hand}))
    assert named.awaited == "waiting for the export to be named"
    assert make_bench(load_bench("virtual").content).awaited == ""
