"""Exports with one known change each, and what a reader must make of them."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

from workbench.tracking import SampleStatus

FRAMES = 12
UNITS = {"Meters": 1.0, "Centimeters": 0.01, "Millimeters": 0.001}
Cells = list[bytes]


@dataclass(frozen=True)
class Export:
    """An export as lines: its head, and for each frame the lines that tell of it."""

    flavour: str
    head: tuple[bytes, ...]
    frames: tuple[tuple[bytes, ...], ...]

    @property
    def is_motive(self) -> bool:
        return self.flavour.startswith("motive")

    def line(self, frame: int, row: int = 0) -> int:
        """Return the number in the file of one row of a frame, from 1."""
        return len(self.head) + sum(map(len, self.frames[:frame])) + row + 1

    def text(self, end: bytes = b"\r\n") -> bytes:
        return b"".join(line + end for line in (*self.head, *(r for f in self.frames for r in f)))

    def with_row(self, frame: int, row: int, cells: Cells) -> Export:
        rows = list(self.frames[frame])
        rows[row] = b",".join(cells)
        frames = (*self.frames[:frame], tuple(rows), *self.frames[frame + 1 :])
        return replace(self, frames=frames)


def first_frames(flavour: str, data: bytes, count: int = FRAMES) -> Export:
    """Return the first frames of one of our stored exports."""
    lines = data.removesuffix(b"\r\n").split(b"\r\n")
    start = b"frame," if flavour.startswith("row") else b"0,"
    at = next(i for i, line in enumerate(lines) if line.startswith(start))
    each = 4 if flavour.startswith("row") else 1
    frames = [tuple(lines[i : i + each]) for i in range(at, len(lines), each)][:count]
    stored = b"%d" % ((len(lines) - at) // each)
    told = (b"framecount,", b"Frames in Take,", b"Exported Frames,")
    head = lines[:at]
    for key in told:
        head = [line.replace(key + stored, key + b"%d" % count) for line in head]
    return Export(flavour, tuple(head), tuple(frames))


@dataclass(frozen=True)
class Answer:
    """What a reader must make of a changed export.

    Args:
        frames: which frames of the unchanged export, in their order.
        shift: added to their indices.
        scale: of lengths.
        hidden: (body, frame, marker) measured markers that are gone.
        lost: (body, frame, reason) samples that no longer count as seen.
        refused: where not empty, the pattern of the error.
        same_cloud: whether the points without a body are the same.
        dark: frames in which nothing is seen: no body, no marker, no other point.
        untangled: an export without the exchange of T and Rotor, whose motion must come out.
    """

    frames: tuple[int, ...] = tuple(range(FRAMES))
    shift: int = 0
    scale: float = 1.0
    hidden: tuple[tuple[str, int, int], ...] = ()
    lost: tuple[tuple[str, int, SampleStatus], ...] = ()
    refused: str = ""
    same_cloud: bool = True
    dark: tuple[int, ...] = ()
    untangled: bytes = b""


class Change(NamedTuple):
    """A changed export and what a reader must make of it."""

    text: bytes
    answer: Answer


Mutation = Callable[[Export, random.Random], Change]


def presented(export: Export, rng: random.Random) -> Change:
    """Write the same differently: line ends, mark, blank lines, trailing commas, counts."""
    lines = [*export.head, *(row for frame in export.frames for row in frame)]
    if rng.random() < 0.5:
        lines = [line + b",," for line in lines]
    if rng.random() < 0.5:
        lines.insert(rng.randrange(2, len(lines)), b"")
    end = rng.choice([b"\n", b"\r\n"])
    text = b"".join(line + end for line in lines)
    if rng.random() < 0.5:
        text = re.sub(rb"(Frames|framecount),12\b", rb"\1,%d" % rng.randrange(99), text)
    return Change(rng.choice([b"", b"\xef\xbb\xbf"]) + text, Answer())


def selected(export: Export, rng: random.Random) -> Change:
    """Drop, repeat or swap frames, or cut the end off between two of them."""
    order, at = list(range(FRAMES)), rng.randrange(FRAMES)
    kind = rng.randrange(4)
    if kind == 0:
        del order[at]
    elif kind == 1:
        order.insert(rng.randrange(FRAMES), at)
    elif kind == 2:
        other = rng.randrange(FRAMES)
        order[at], order[other] = order[other], order[at]
    else:
        del order[max(3, at) :]
    frames = tuple(export.frames[i] for i in order)
    return Change(replace(export, frames=frames).text(), Answer(tuple(order)))


def renumbered(export: Export, rng: random.Random) -> Change:
    """Start the frame index elsewhere; in Motive files the times follow."""
    shift = rng.choice([-7, 1, 120, 72210])

    def moved(row: bytes) -> bytes:
        cells = row.split(b",")
        at = 0 if export.is_motive else 1
        cells[at] = b"%d" % (int(cells[at]) + shift)
        return b",".join(cells)

    frames = tuple(tuple(map(moved, frame)) for frame in export.frames)
    return Change(replace(export, frames=frames).text(), Answer(shift=shift))


def in_other_units(export: Export, rng: random.Random) -> Change:
    """Claim another unit of length."""
    unit, key = rng.choice(list(UNITS)), rb"(?<=Units,)[A-Za-z]+"
    old = re.search(key, export.head[0])
    if old is None:
        raise AssertionError("the header names no unit")
    head = (re.sub(key, unit.encode(), export.head[0]), *export.head[1:])
    answer = Answer(scale=UNITS[unit] / UNITS[old[0].decode()])
    return Change(replace(export, head=head).text(), answer)


def entities(export: Export) -> list[list[int]]:
    """Return the neighbouring columns of each entity of a Motive export."""
    rows = [line.split(b",") for line in export.head[2:5]]
    keys = [tuple(row[i] for row in rows) for i in range(2, len(rows[0]))]
    blocks: list[list[int]] = []
    for i, key in enumerate(keys, start=2):
        if blocks and keys[blocks[-1][-1] - 2] == key:
            blocks[-1].append(i)
        else:
            blocks.append([i])
    return blocks


def reordered(export: Export, rng: random.Random) -> Change:
    """Give the entities' columns, or the rows and poses of bodies, in another order."""
    if export.is_motive:
        blocks = entities(export)
        rng.shuffle(blocks)
        columns = [0, 1, *(i for block in blocks for i in block)]

        def moved(line: bytes) -> bytes:
            cells = line.split(b",")
            return b",".join([cells[i] for i in columns])

        head = (*export.head[:2], *map(moved, export.head[2:]))
        frames = tuple(tuple(map(moved, frame)) for frame in export.frames)
        return Change(Export(export.flavour, head, frames).text(), Answer())
    frames = []
    for first, *bodies in export.frames:
        cells = first.split(b",")
        count = int(cells[3])
        poses = [cells[4 + 11 * k : 15 + 11 * k] for k in range(count)]
        rng.shuffle(poses)
        rng.shuffle(bodies)
        first = b",".join([*cells[:4], *(c for p in poses for c in p), *cells[4 + 11 * count :]])
        frames.append((first, *bodies))
    return Change(replace(export, frames=tuple(frames)).text(), Answer())


def hidden(export: Export, rng: random.Random) -> Change:
    """Hide one measured marker of a body in one frame."""
    frame = rng.randrange(FRAMES)
    if export.is_motive:
        names, types = export.head[3].split(b","), export.head[2].split(b",")
        blocks = [b for b in entities(export) if names[b[0]].startswith(b"T:")]
        block = rng.choice([b for b in blocks if types[b[0]] == b"Marker"])
        cells = export.frames[frame][0].split(b",")
        for i in block:
            cells[i] = b""
        marker = int(re.sub(rb"\D", b"", names[block[0]])) - 1
        return Change(
            export.with_row(frame, 0, cells).text(), Answer(hidden=(("T", frame, marker),))
        )
    marker, cells = rng.randrange(2), export.frames[frame][2].split(b",")
    start = len(cells) - 1 - 4 - 6 + 3 * marker
    cells[start : start + 3] = [rng.choice([b"NAN", b"1.#QNAN", b"-1.#IND"])] * 3
    answer = Answer(hidden=(("T", frame, marker),), same_cloud=False)
    return Change(export.with_row(frame, 2, cells).text(), answer)


def lost(export: Export, rng: random.Random) -> Change:
    """Lose a body in one frame: blank cells, or a lost counter above zero."""
    frame = rng.randrange(FRAMES)
    if not export.is_motive:
        cells = export.frames[frame][2].split(b",")
        cells[5] = b"%d" % rng.randrange(1, 999)
        return Change(
            export.with_row(frame, 2, cells).text(), Answer(lost=(("T", frame, SampleStatus.LOST),))
        )
    names, types = export.head[3].split(b","), export.head[2].split(b",")
    cells = export.frames[frame][0].split(b",")
    for i, (name, kind) in enumerate(zip(names, types, strict=True)):
        if (name, kind) == (b"T", b"Rigid Body"):
            cells[i] = b""
    return Change(
        export.with_row(frame, 0, cells).text(), Answer(lost=(("T", frame, SampleStatus.BLANK),))
    )


def dark(export: Export, rng: random.Random) -> Change:
    """Show nothing in some frames, perhaps in the first, the last or in all but one."""
    count = rng.choice([1, 2, FRAMES - 1])
    frames = rng.sample(range(FRAMES), count) if rng.random() < 0.7 else range(count)
    for frame in frames:
        if export.is_motive:
            cells = export.frames[frame][0].split(b",")
            export = export.with_row(frame, 0, [*cells[:2], *[b""] * (len(cells) - 2)])
            continue
        first, *bodies = (row.split(b",") for row in export.frames[frame])
        export = export.with_row(frame, 0, [*first[:3], b"0", b"0"])
        for row, cells in enumerate(bodies, start=1):
            markers = int(cells[6])
            at = len(cells) - 1 - 5 * markers  # where the seen places begin
            cells[5] = b"%d" % (frame + 1)
            cells[at : at + 3 * markers] = [b"NAN"] * (3 * markers)
            cells[at + 3 * markers : at + 4 * markers] = [b"0"] * markers
            export = export.with_row(frame, row, cells)
    return Change(export.text(), Answer(dark=tuple(sorted(frames))))


def exchanged(export: Export, rng: random.Random) -> Change:
    """Exchange the bodies T and Rotor in less than half of the frames; of poses alone too."""
    start = rng.randrange(1, FRAMES - 2)
    frames = range(start, min(FRAMES, start + rng.randint(1, 5)))
    if export.is_motive and rng.random() < 0.5:
        export = poses_alone(export)
    base = export
    for frame in frames:
        if export.is_motive:
            cells = export.frames[frame][0].split(b",")
            ours, theirs = columns_of(export, b"T"), columns_of(export, b"Rotor")
            for a, b in zip(ours, theirs, strict=True):
                cells[a], cells[b] = cells[b], cells[a]
            export = export.with_row(frame, 0, cells)
            continue
        first, foot, top, rotor = (row.split(b",") for row in export.frames[frame])
        top[5:], rotor[5:] = rotor[5:], top[5:]
        ids = {b"2": b"3", b"3": b"2"}
        for at in range(4, 4 + 11 * int(first[3]), 11):
            first[at] = ids.get(first[at], first[at])
        for row, cells in enumerate((first, foot, top, rotor)):
            export = export.with_row(frame, row, cells)
    return Change(export.text(), Answer(untangled=base.text()))


def poses_alone(export: Export) -> Export:
    """Return a Motive export without its markers; cameras never see a pose twice."""
    types = export.head[2].split(b",")
    columns = [0, 1, *(i for i, kind in enumerate(types) if kind == b"Rigid Body")]

    def kept(line: bytes) -> bytes:
        cells = line.split(b",")
        return b",".join([cells[i] for i in columns])

    rows = [kept(rows[0]).split(b",") for rows in export.frames]
    for k, cells in enumerate(rows):
        for i, part in enumerate(kept(export.head[-2]).split(b",")):
            if part == b"Position" and cells[i]:
                cells[i] = b"%.6f" % (float(cells[i]) + 1e-6 * (k * k % 7))
    head = (*export.head[:2], *map(kept, export.head[2:]))
    return Export(export.flavour, head, tuple((b",".join(cells),) for cells in rows))


def columns_of(export: Export, body: bytes) -> list[int]:
    """Return the columns of a body and of its markers, in their order."""
    names = export.head[3].split(b",")
    return [i for i, name in enumerate(names) if re.fullmatch(body + rb"([:_].*)?", name)]


def damaged(export: Export, rng: random.Random) -> Change:
    """Lose or add a cell, cut a row, or put a word where a number belongs."""
    frame = rng.randrange(1, FRAMES)
    row = rng.randrange(len(export.frames[frame]))
    cells = export.frames[frame][row].split(b",")
    line = export.line(frame, row)
    kind, at = rng.randrange(4), rng.randrange(1, len(cells))
    if kind == 0:
        del cells[at]
    elif kind == 1:
        cells.insert(at, rng.choice([b"", b"1.5", b"x"]))
    elif kind == 2:
        cells = cells[:at]
    else:
        at = rng.choice(number_columns(export, cells))
        cells[at] = rng.choice([b"x", b"0..1", b"--", b"1 2", b"1e", b"nan(ind)"])
    return Change(export.with_row(frame, row, cells).text(), Answer(refused=rf":{line}: "))


def number_columns(export: Export, cells: Cells) -> list[int]:
    """Return columns of a row that are read as numbers."""
    if export.is_motive:
        return [0, 1, 5, len(cells) - 1]
    if cells[0] == b"frame":
        return [1, 2, 3]
    return [1, 5, 6, 7, len(cells) - 1]


KNOWN: dict[str, Mutation] = {
    mutation.__name__: mutation
    for mutation in (
        presented,
        selected,
        renumbered,
        reordered,
        hidden,
        lost,
        dark,
        exchanged,
        damaged,
    )
}
MOTIVE_ONLY: dict[str, Mutation] = {"in_other_units": in_other_units}
