"""A word means the same runs to every verb."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.bundles import NOW, make_bundle
from workbench.bundle import run_named, runs_named
from workbench.errors import InputError


def test_a_run_is_found_by_path_name_number_or_part(tmp_path: Path) -> None:
    names = ("hop-17.00", "clamped-14.00", "clamped-19.00")
    first, second, third = (
        make_bundle(tmp_path, n, NOW.replace(minute=k)).path for k, n in enumerate(names)
    )
    for word in (str(first), first.name, "1", "hop"):
        assert run_named(Path(word), tmp_path) == first
    assert run_named(Path("CLAMPED-14"), tmp_path) == second
    assert run_named(Path("3"), tmp_path) == third
    with pytest.raises(
        InputError, match=rf"'clamped' fits 2 runs in .*: {third.name}, {second}"[:60]
    ):
        run_named(Path("clamped"), tmp_path)
    with pytest.raises(InputError, match=r"run 4: .* holds 3 runs, numbered from 1"):
        run_named(Path("4"), tmp_path)
    with pytest.raises(InputError, match=rf"did you mean '{first.name}'"):
        run_named(Path(first.name.replace("hop", "hpo")), tmp_path)


def test_whole_words_go_before_parts_and_a_part_before_several_runs(tmp_path: Path) -> None:
    made = [
        make_bundle(tmp_path, name, NOW.replace(minute=k), protocol=f"{protocol}.yaml",
                    experiment=experiment).path
        for k, (name, protocol, experiment) in enumerate((
            ("hop-17", "scan-hop-17", "e-1"), ("drop", "hop-17", "e-2"),
            ("hop-16", "hop-17", "e-3"), ("drop", "hop-17", "e-3"),
        ))
    ]  # fmt: skip
    assert runs_named([Path("hop-17")], tmp_path) == made[2:]  # the newest of the protocol
    assert runs_named([Path("HOP-17")], tmp_path) == made[:1]  # no protocol: a part
    assert run_named(Path("hop-17"), tmp_path) == made[0]
    assert run_named(Path("e-2"), tmp_path) == made[1]
    assert run_named(Path("scan-hop-17.yaml"), tmp_path) == made[0]
    with pytest.raises(InputError, match="'e-3' fits 2 runs in"):
        run_named(Path("e-3"), tmp_path)
    with pytest.raises(InputError, match=f"'{tmp_path}' fits 4 runs in {tmp_path}: "):
        run_named(tmp_path, tmp_path)
    with pytest.raises(InputError, match="'drop' fits 2 runs in"):
        runs_named([Path("drop")], tmp_path)


def test_the_runs_stand_in_the_order_of_the_words(tmp_path: Path) -> None:
    made = [make_bundle(tmp_path, name).path for name in ("clamped", "hop")]
    assert runs_named([Path("hop"), Path("1"), tmp_path], tmp_path) == [made[1], made[0], *made]


def test_a_dot_in_a_run_s_name_is_no_file_s_ending(tmp_path: Path) -> None:
    run = make_bundle(tmp_path, "hop-16.99", experiment="e-1", protocol="a.yaml").path
    make_bundle(tmp_path, "drop", experiment="e-2", protocol="hop-16.yaml")
    assert runs_named([Path("hop-16.99")], tmp_path) == [run]


@pytest.fixture
def scan(tmp_path: Path) -> list[Path]:
    """Two runs of an experiment that carried out `short.yaml`, which lies beside them."""
    (tmp_path / "short.yaml").write_text("", encoding="utf-8")
    return [
        make_bundle(tmp_path / "runs", name, protocol="short.yaml", experiment="e-1").path
        for name in ("decay", "hop")
    ]


@pytest.mark.parametrize("word", ["short", "short.yaml", "somewhere/short.yaml", "e-1"])
def test_a_protocol_or_an_experiment_stands_for_its_runs(scan: list[Path], word: str) -> None:
    root = scan[0].parent
    assert runs_named([Path(word)], root) == scan
    assert runs_named([Path(scan[1].name)], root) == scan[1:]


def test_the_protocol_s_own_file_stands_for_its_runs_too(scan: list[Path]) -> None:
    root = scan[0].parent
    assert runs_named([root.parent / "short.yaml"], root) == scan


def test_damaged_folders_do_not_hide_an_experiment(scan: list[Path]) -> None:
    root = scan[0].parent
    for name, text in {"broken": "{", "empty": None, "file": ""}.items():
        if name == "file":
            (root / name).write_text("", encoding="utf-8")
            continue
        (root / name).mkdir()
        if text is not None:
            (root / name / "manifest.json").write_text(text, encoding="utf-8")
    assert runs_named([Path("short")], root) == scan


def test_a_name_that_is_none_is_answered_with_the_protocols(scan: list[Path]) -> None:
    root = scan[0].parent
    for ask in (lambda word: runs_named([word], root), lambda word: run_named(word, root)):
        with pytest.raises(InputError, match=r"shrt: no run.*did you mean 'short'\?"):
            ask(Path("shrt"))
        with pytest.raises(InputError, match=r"what: no run.* 2 runs; there are the protocols sho"):
            ask(Path("what"))


def test_a_folder_that_holds_no_run_is_told_as_such(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match=r"folder: not a bundle, it has no manifest\.json"):
        runs_named([tmp_path / "folder"], tmp_path)
