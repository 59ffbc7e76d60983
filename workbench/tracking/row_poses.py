"""Poses of rewritten row formats, whose frame rows have other body ids than the body rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from workbench.tracking.row_table import MODEL_WIDTH, BodyRows, RowTable
from workbench.tracking.source import Source, listed, shown

__all__ = ["with_own_poses"]

_FARTHEST_M = 0.2  # of a body's origin from the middle of its markers
_RIGID_M = 5e-3  # how much that distance may change
_UNFIT = 1e3  # a cost above any distance [m]


def with_own_poses(table: RowTable, source: Source) -> RowTable:
    """Return a table in which every pose belongs to a body that rows define.

    Where frame rows list ids that nothing else names, each body with rows of its own gets the poses
    that move with its model markers. Where there are no such bodies, the ids are the names.
    """
    strangers = [rows for rows in table.bodies if rows.name == "" and not len(rows.frames)]
    if not strangers:
        return table
    ids = listed(rows.id for rows in strangers)
    if not any(len(rows.frames) for rows in table.bodies):
        source.warn(
            f"frame rows track bodies with the ids {ids}, which no row defines; the ids are taken "
            "for their names"
        )
        named = (replace(r, name=r.name or f"Body {r.id}") for r in table.bodies)
        return replace(table, bodies=tuple(named))
    posed = [rows for rows in table.bodies if rows.posed.any()]
    whole = [rows for rows in table.bodies if len(rows.frames)]
    owner = _owners(posed, whole, table)
    n = len(table.indices)
    none = {"posed": np.zeros(n, dtype=np.bool_), "poses": np.full((n, 7), np.nan)}
    bodies = []
    for rows in table.bodies:
        if rows in strangers:
            continue
        of = owner.get(rows.id)
        given = none if of is None else {"posed": of.posed, "poses": of.poses}
        bodies.append(replace(rows, **(given if len(rows.frames) else {})))
    taken = [
        f"{shown(of.id)} for {shown(name)}"
        for name, of in ((rows.name, owner.get(rows.id)) for rows in whole)
        if of is not None
    ]
    source.warn(
        f"frame rows track bodies with the ids {ids}, which no other row names: rewritten by a "
        "program? The bodies' own rows are read; poses are taken by where the markers are: "
        + (", ".join(taken) or "none")
    )
    return replace(table, bodies=tuple(bodies))


def _owners(posed: list[BodyRows], whole: list[BodyRows], table: RowTable) -> dict[str, BodyRows]:
    """Return by body id the rows whose poses move with that body's model markers."""
    cost = np.array([[_apart(poses, rows, table) for rows in whole] for poses in posed])
    pairs = zip(*scipy.optimize.linear_sum_assignment(cost), strict=True)
    return {whole[j].id: posed[i] for i, j in pairs if cost[i, j] < _UNFIT}


def _apart(poses: BodyRows, rows: BodyRows, table: RowTable) -> float:
    """Return the distance of a pose's origin from the markers [m]; `_UNFIT` if it varies."""
    width, m = MODEL_WIDTH[table.version], rows.markers
    if m == 0:
        return _UNFIT
    markers = rows.values[:, : width * m].reshape(-1, m, width)[:, :, :3]
    middle = np.full((len(table.indices), 3), np.nan)
    middle[rows.frames[rows.lost == 0]] = markers[rows.lost == 0].mean(axis=1)
    off = np.linalg.norm(poses.poses[:, :3] - middle, axis=1)
    off = off[np.isfinite(off)]
    if not len(off):
        return _UNFIT
    usual = float(np.median(off))
    rigid = float(np.quantile(np.abs(off - usual), 0.9)) < _RIGID_M
    return usual if rigid and usual < _FARTHEST_M else _UNFIT
