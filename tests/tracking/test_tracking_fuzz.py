"""Whatever the bytes, the reader returns a take with a report, or raises TakeError."""

from __future__ import annotations

import json
import random
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from workbench.errors import TakeError
from workbench.tracking import quality, read_take

MUTATIONS = 700
CELLS = [
    b"",
    b"nan",
    b"inf",
    b"1e308",
    b"-1",
    b"1.5",
    b"x",
    b'"',
    b"1,2",
    b"1e9",
    b"1.#QNAN",
    b"\xff",
]


def check(path: Path, data: bytes) -> bool:
    """Return whether the data could be read; any error but TakeError fails the test."""
    path.write_bytes(data)
    try:
        take = read_take(path)
    except TakeError as error:
        if str(path) not in str(error):
            raise AssertionError(f"the message does not name the file: {error}") from error
        return False
    json.dumps(quality(take), allow_nan=False)
    return True


def shorten(data: bytes) -> bytes:
    """Keep the header and a few rows: a small file makes a mutation matter."""
    return b"\r\n".join(data.split(b"\r\n")[:32])


def mutate(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\r\n")
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(lines))
        cells = lines[at].split(b",")
        kind = rng.randrange(8)
        if kind == 0:
            lines[at] = lines[at][: rng.randint(0, len(lines[at]))]
        elif kind == 1:
            cells[rng.randrange(len(cells))] = rng.choice(CELLS)
            lines[at] = b",".join(cells)
        elif kind == 2:
            del lines[at]
            lines = lines or [b""]
        elif kind == 3:
            lines.insert(at, lines[rng.randrange(len(lines))])
        elif kind == 4:
            cells.insert(rng.randrange(len(cells)), rng.choice(CELLS))
            lines[at] = b",".join(cells)
        elif kind == 5:
            del cells[rng.randrange(len(cells))]
            lines[at] = b",".join(cells)
        elif kind == 6 and lines[at]:
            raw = bytearray(lines[at])
            raw[rng.randrange(len(raw))] = rng.randrange(256)
            lines[at] = bytes(raw)
        else:
            other = rng.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at]
    return b"\r\n".join(lines)


@pytest.mark.parametrize(
    "flavour", ["row_1.0", "row_1.1", "motive_1.21", "motive_1.23", "motive_1.25"]
)
def test_no_other_error_escapes_for_mutated_exports(
    flavour: str, stored: Path, tmp_path: Path
) -> None:
    rng = random.Random(flavour)
    data = shorten((stored / f"hop_{flavour}.csv").read_bytes())
    read = [check(tmp_path / "x.csv", mutate(data, rng)) for _ in range(MUTATIONS)]
    # the test is worth something only while both outcomes are common
    assert 0.1 < sum(read) / len(read) < 0.95


@pytest.mark.parametrize("flavour", ["row_1.1", "motive_1.23"])
def test_no_other_error_escapes_for_cut_exports(flavour: str, stored: Path, tmp_path: Path) -> None:
    data = shorten((stored / f"hop_{flavour}.csv").read_bytes())
    for length in range(0, len(data), max(1, len(data) // 300)):
        check(tmp_path / "x.csv", data[:length])


@settings(
    max_examples=200,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(
    head=st.sampled_from([b"", b"comment,", b"frame,", b"Format Version,1.23\n"]), tail=st.binary()
)
def test_no_other_error_escapes_for_any_bytes(
    tmp_path_factory: pytest.TempPathFactory, head: bytes, tail: bytes
) -> None:
    check(tmp_path_factory.getbasetemp() / "any.csv", head + tail)
