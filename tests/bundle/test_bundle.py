import json
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from tests.bundles import asked_for, journal_of, manifest_of
from workbench.bundle import Bundle, bundle_names, events, verify
from workbench.errors import InputError
from workbench.timeseries import TimeSeries

NOW = datetime(2026, 3, 12, 10, 15, 0)


@pytest.fixture
def bundle(tmp_path: Path) -> Bundle:
    found = Bundle.create(tmp_path / "runs", "hop-16.99", NOW, asked_for(title="Hop"))
    found.record.journal(events.OutputOn(volts="4.52"), 2.0)
    found.record.wire('{"way": "sent"}')
    found.write_document("protocol", "title: Hop\r\n")
    return found


def test_the_status_is_failed_until_the_last_line(bundle: Bundle) -> None:
    assert manifest_of(Bundle.open(bundle.path))["status"] == "failed"
    bundle.finish("complete")
    assert manifest_of(Bundle.open(bundle.path))["status"] == "complete"


def test_two_runs_in_one_second_get_two_folders(bundle: Bundle) -> None:
    again = Bundle.create(bundle.path.parent, "hop-16.99", NOW)
    assert bundle.path.name == "2026-03-12_101500_hop-16.99"
    assert again.path.name == "2026-03-12_101500_hop-16.99_2"


def test_runs_of_one_second_are_listed_as_they_were_begun(tmp_path: Path) -> None:
    begun = [Bundle.create(tmp_path, name, NOW).path.name for name in ("hop", "decay", "clamped")]
    assert begun[1] == "2026-03-12_101501_decay"
    assert bundle_names(tmp_path) == begun
    begun.append(Bundle.create(tmp_path, "drop", NOW + timedelta(seconds=1)).path.name)
    begun.append(Bundle.create(tmp_path, "drop", NOW + timedelta(seconds=3)).path.name)
    assert begun[-1] == "2026-03-12_101503_drop"
    assert bundle_names(tmp_path) == begun


def test_files_are_kept_byte_for_byte(bundle: Bundle, tmp_path: Path) -> None:
    source = tmp_path / "Take 1.csv"
    source.write_bytes(b"\xef\xbb\xbfa,b\r\n\x00")
    assert bundle.add_take(source).read_bytes() == source.read_bytes()
    assert bundle.take().name == "Take 1.csv"
    assert bundle.document("protocol").read_bytes() == b"title: Hop\r\n"


def test_a_time_series_comes_back_with_its_mask(bundle: Bundle) -> None:
    valid = {"a_m": np.array([True, False, True])}
    columns = {"a_m": np.array([1.0, 2.0, 3.0]), "b_m": np.array([0.0, np.nan, 1.0])}
    series = TimeSeries.of(np.arange(3) / 120, columns, valid)
    bundle.series.write("track", series, {"take": "abc"})
    found = bundle.series.read("track")
    assert found.names == series.names
    assert np.array_equal(found.values, series.values, equal_nan=True)
    assert np.array_equal(found.valid, series.valid)


def test_a_journal_cut_off_in_a_line_keeps_the_lines_before(bundle: Bundle) -> None:
    with (bundle.path / "journal.jsonl").open("a") as file:
        file.write('{"time_s": 3.0, "eve')
    assert [e["event"] for e in journal_of(bundle)] == ["output_on"]


def test_verify_names_the_file_that_changed_is_missing_or_is_new(bundle: Bundle) -> None:
    bundle.finish("complete")
    assert verify(bundle.path) == []
    text = (bundle.path / "protocol.yaml").read_bytes()
    (bundle.path / "protocol.yaml").write_bytes(text.replace(b"H", b"h"))
    (bundle.path / "wire.log").unlink()
    (bundle.path / "extra.txt").write_text("x")
    assert verify(bundle.path) == [
        "protocol.yaml: changed since the run was finished",
        "wire.log: missing",
        "extra.txt: not in checksums.txt",
    ]


def test_verify_tells_a_run_that_was_cut_off(bundle: Bundle) -> None:
    (told,) = verify(bundle.path)  # its journal ends with the output on
    cut_off = "checksums.txt: missing; the run was cut off (status failed)"
    assert told.startswith(f"{cut_off}; OUTPUT MAY BE ON (it was switched on, and off was not")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "not a bundle, it has no manifest.json"),
        ("{", r"manifest\.json: damaged: "),
        (json.dumps({"schema": "other"}), "not a manifest of schema workbench/bundle-1"),
    ],
)
def test_a_folder_that_is_no_bundle_is_refused(
    tmp_path: Path, content: str | None, words: str
) -> None:
    if content is not None:
        (tmp_path / "manifest.json").write_text(content)
    with pytest.raises(InputError, match=words):
        Bundle.open(tmp_path)


def test_a_bundle_without_a_take_says_so(bundle: Bundle) -> None:
    with pytest.raises(InputError, match="holds no take"):
        bundle.take()
    with pytest.raises(InputError, match=r"twin\.parquet: cannot be read"):
        bundle.series.read("twin")
