"""Feed the reader changed exports: it must give the right answer, or refuse with line and cause.

    python tests/tracking/fuzzing.py [--files 100000] [--seed 1]

Half of the files have one known change (`mutations.py`): the answer is compared number by number.
The others are damaged blindly; there every number must stand in its own row of the text, every NaN
must have a blank cell there, and rows must neither get lost nor appear. Where the bulk reader
answers, the careful one must give the same take.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import os
import random
import re
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields
from pathlib import Path
from typing import NamedTuple
from unittest import mock

import numpy as np
from comparing import differences
from mutations import KNOWN, MOTIVE_ONLY, Export, first_frames

from workbench.errors import TakeError
from workbench.tracking import Axes, BodyNames, BodyTake, Take, quality, raw_points, read_take

STORED = Path(__file__).parents[1] / "data" / "tracking"
FLAVOURS = (
    "row_1.0", "row_1.1", "motive_1.21", "motive_1.22", "motive_1.23", "motive_1.24", "motive_1.25"
)  # fmt: skip
CELLS = [
    b"", b"nan", b"inf", b"1e308", b"-1", b"1.5", b"x", b'"', b"1,2", b"1e9", b"1.#QNAN", b"\xff",
    b"nan(1)", b" ", b"+1", b"1_0", b'"0.5"', b"0x1", b"\xc2\xa01",
]  # fmt: skip
BATCH = 250
BULK = ("workbench.tracking.row_format.read_bulk", "workbench.tracking.motive_table.read_bulk")


class Outcome(NamedTuple):
    """What came of one file: `read` or the cause of the refusal, and what is wrong, if anything."""

    cause: str
    faults: list[str]


def base_export(flavour: str) -> Export:
    return first_frames(flavour, (STORED / f"hop_{flavour}.csv").read_bytes())


def attempt(path: Path) -> Take | str:
    """Return the take or the words of the refusal; any other error escapes."""
    try:
        return read_take(path)
    except TakeError as error:
        return str(error)


def check(path: Path, text: bytes) -> tuple[Take | str, list[str]]:
    """Read in bulk and row by row; return the result and what is wrong with any export."""
    path.write_bytes(text)
    with mock.patch("workbench.tracking.source.LARGE", 0):
        found = attempt(path)
    with mock.patch(BULK[0], _declines), mock.patch(BULK[1], _declines):
        careful = attempt(path)
    if isinstance(found, str) or isinstance(careful, str):
        faults = [] if found == careful else [f"in bulk {found}, row by row {careful}"]
        return found, [*faults, *unclear(str(found), path, text)]
    json.dumps(quality(found), allow_nan=False)
    return found, unlike(found, careful)


def _declines(*_: object) -> None:
    """Stand in for a bulk reader."""


def unclear(message: str, path: Path, text: bytes) -> list[str]:
    """Return what a refusal lacks: the file, a line that exists, a cause."""
    told = re.match(rf"{re.escape(str(path))}:(\d+): .{{10}}", message, re.DOTALL)
    lines = len(re.findall(rb"\r\n|\r|\n", text)) + 1
    return [] if told and 1 <= int(told[1]) <= lines else [f"unclear: {message}"]


def unlike(a: Take | BodyTake, b: Take | BodyTake) -> list[str]:
    """Return the fields in which the bulk reader and the careful one disagree."""
    found: list[str] = []
    for each in fields(a):
        one, other = getattr(a, each.name), getattr(b, each.name)
        if each.name == "bodies":
            if list(one) != list(other):
                return ["bulk: bodies"]
            found += [fault for name in one for fault in unlike(one[name], other[name])]
        elif each.name == "cloud":
            pairs = ((one.position, other.position), (one.names, other.names))
            found += ["bulk: cloud"] * (not all(identical(x, y) for x, y in pairs))
        elif isinstance(one, np.ndarray):
            found += [f"bulk: {each.name}"] * (not identical(one, other))
        elif one is not other and one != other:
            found.append(f"bulk: {each.name}: {one!r}, row by row {other!r}")
    return found


def identical(a: np.ndarray, b: np.ndarray) -> bool:
    if a.shape != b.shape or a.dtype != b.dtype:
        return False
    return bool((a == b).all()) if a.dtype == object else bool(np.array_equal(a, b, equal_nan=True))


def mutate(data: bytes, rng: random.Random) -> bytes:
    """Damage an export blindly in one to four places."""
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


def rows_of(text: bytes, take: Take) -> list[list[list[str]]]:
    """Return the cells that tell of each frame, found without the reader's help."""
    encoding = "utf-8-sig" if is_utf8(text) else "latin-1"
    plain = text.removeprefix(b"\xef\xbb\xbf").decode(encoding)
    rows = [row for row in csv.reader(io.StringIO(plain, newline="")) if any(row)]
    words = [row[0].strip().casefold() for row in rows]
    if take.format == "motive":
        return [[row] for row in rows[words.index("frame") + 1 :]]
    starts = [i for i, word in enumerate(words) if word == "frame"]
    return [rows[i:j] for i, j in zip(starts, [*starts[1:], len(rows)], strict=True)]


def is_utf8(text: bytes) -> bool:
    try:
        text.decode("utf-8-sig")
    except UnicodeDecodeError:
        return False
    return True


def untrue(take: Take, text: bytes) -> list[str]:
    """Return what a take tells that its text does not: frames, numbers, samples that are gone."""
    frames = rows_of(text, take)
    if len(frames) != len(take):
        return [f"{len(take)} frames, the text has {len(frames)}"]
    unit = take.header.get("Length Units", "Meters").casefold()
    scale = {"millimeters": 0.001, "centimeters": 0.01}.get(unit, 1.0)
    faults: list[str] = []
    for i, rows in enumerate(frames):
        told = [as_number(cell) for row in rows for cell in row]
        numbers = np.array([x for x in told if x is not None and np.isfinite(x)]) * scale
        places = [take.cloud.position[i], *(p for b in take.bodies.values() for p in parts(b, i))]
        given = np.concatenate([place.ravel() for place in places])
        given = given[np.isfinite(given)]
        if not np.isin(given, numbers).all():
            faults.append(f"frame {i} holds numbers that its rows do not")
        faults += [f"frame {i}: {fault}" for fault in gone(take, i, rows)]
    return faults


def parts(body: BodyTake, i: int) -> Iterator[np.ndarray]:
    yield body.position[i]
    yield body.measured[i]
    yield body.solved[i]


def gone(take: Take, i: int, rows: list[list[str]]) -> Iterator[str]:
    """Yield what is NaN though its cells hold numbers."""
    for body in take.bodies.values():
        own, place, pose = rows[0], body.position[i], True
        if take.format == "row":
            reports = [row for row in rows[1:] if tells_of(row, body)]
            pose = body.id in [
                cell.strip() for cell in rows[0][4 : 4 + 11 * int(float(rows[0][3])) : 11]
            ]
            own = [*(reports[-1] if reports else [""]), *rows[0]]
        if any(is_blank(cell) for cell in own):
            continue
        if np.isnan(body.measured[i]).any() or (pose and np.isnan(place).any()):
            yield f"{body.name} is gone and no cell is blank"


def tells_of(row: list[str], body: BodyTake) -> bool:
    word = row[0].strip().casefold()
    return word in ("trackable", "rigidbody") and len(row) > 4 and row[4].strip() == body.id


def is_blank(cell: str) -> bool:
    number = as_number(cell)
    return not cell.strip() or "#" in cell or (number is not None and not np.isfinite(number))


def as_number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None


def tangled(found: Take, text: bytes, path: Path) -> list[str]:
    """Return where the bodies are not those of the export without the exchange, and what is silent.

    Args:
        found: the take in which T and Rotor were exchanged.
        text: the export without the exchange.
        path: for it.
    """
    path.write_bytes(text)
    base = read_take(path)
    points, right = (raw_points(take, BodyNames(), Axes()) for take in (found, base))
    faults = [] if any("exchanged" in told for told in points.warnings) else ["silent exchange"]
    for role, body in right.bodies.items():
        mine = points.bodies[role]
        both = body.position, mine.position
        if not np.allclose(*both, rtol=0, atol=1e-9, equal_nan=True):
            faults.append(f"{role} is elsewhere by {np.nanmax(np.abs(both[0] - both[1])):.2g} m")
    return faults


def fuzz(flavour: str, seed: str, files: int, folder: Path) -> Iterator[tuple[str, bytes, Outcome]]:
    """Yield the name of each change, the changed text, and what came of it."""
    rng, path = random.Random(f"{flavour} {seed}"), folder / f"{flavour}-{seed}.csv"
    export = base_export(flavour)
    base, faults = check(path, export.text())
    if isinstance(base, str) or faults:
        raise AssertionError(f"{flavour}: the unchanged export: {base} {faults}")
    known = KNOWN | MOTIVE_ONLY if export.is_motive else KNOWN
    for k in range(files):
        if k % 2 == 0:
            name = rng.choice(list(known))
            change = known[name](export, rng)
            text = change.text
            found, faults = check(path, text)
            if isinstance(found, str):
                refused = change.answer.refused
                faults += [] if refused and re.search(refused, found) else [f"refused: {found}"]
            elif change.answer.refused:
                faults.append("a damaged row was read")
            elif change.answer.untangled:
                faults += tangled(found, change.answer.untangled, path)
            else:
                faults += differences(found, base, change.answer)
        else:
            name, text = "blind", mutate(export.text(), rng)
            found, faults = check(path, text)
            if not isinstance(found, str):
                faults += untrue(found, text)
        cause = found.removeprefix(str(path)) if isinstance(found, str) else "read"
        yield name, text, Outcome(cause, faults)
    path.unlink()


def batch(flavour: str, seed: str, files: int) -> tuple[str, Counter[str], list[str]]:
    """Run a batch in a process of its own."""
    counts: Counter[str] = Counter()
    faults: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        for k, (name, _, outcome) in enumerate(fuzz(flavour, seed, files, Path(folder))):
            counts[f"{name}: {plain_cause(outcome.cause)}"] += 1
            faults += [f"{flavour} {seed} file {k} ({name}): {fault}" for fault in outcome.faults]
    return flavour, counts, faults


def plain_cause(cause: str) -> str:
    """Return a refusal without its numbers and names, so that it can be counted."""
    return re.sub(r"'[^']*'|\"[^\"]*\"|-?\d[\d.e+-]*", "_", cause.removeprefix(":"))[:70]


def main() -> None:
    """Print how many files were read and refused, and everything that was wrong."""
    parser = argparse.ArgumentParser(description="Feed the reader changed exports.")
    parser.add_argument("--files", type=int, default=100_000)
    parser.add_argument("--seed", default="1")
    options = parser.parse_args()
    batches = -(-options.files // (BATCH * len(FLAVOURS)))
    jobs = [(flavour, f"{options.seed}.{k}") for k in range(batches) for flavour in FLAVOURS]
    totals: dict[str, Counter[str]] = {flavour: Counter() for flavour in FLAVOURS}
    faults: list[str] = []
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        flavours, seeds = zip(*jobs, strict=True)
        for flavour, counts, found in pool.map(batch, flavours, seeds, [BATCH] * len(jobs)):
            totals[flavour] += counts
            faults += found
    report(totals, faults)
    raise SystemExit(1 if faults else 0)


def report(totals: dict[str, Counter[str]], faults: list[str]) -> None:
    print(f"{'':14}{'files':>8}{'read':>8}{'refused':>9}")
    for flavour, counts in totals.items():
        read = sum(n for cause, n in counts.items() if cause.endswith(": read"))
        print(f"{flavour:14}{counts.total():8}{read:8}{counts.total() - read:9}")
    print("\nby change and cause")
    for cause, n in sum(totals.values(), Counter[str]()).most_common():
        print(f"{n:8}  {cause}")
    print(f"\n{sum(c.total() for c in totals.values())} files, {len(faults)} wrong")
    for fault in faults[:50]:
        print(fault)


if __name__ == "__main__":
    main()
