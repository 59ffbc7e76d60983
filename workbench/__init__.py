"""Workbench for a curved-beam hopping robot: run, track, simulate, compare.

Rooms, from the top: `cli`, `engine`, `review`, `bench`, then side by side `hw`, `tracking` and
`sim`, then `shape`, `bundle` and `protocol`, `motion`, `timeseries`, `errors`. A room imports only
from rooms below it; `lint-imports` holds that.
"""
