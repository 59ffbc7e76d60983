"""Hidden-effect cases: robots whose cause is known and sealed, and the score of who names it.

Two generators make them. `rod*` is an independent engine with its own equations, integrator and
contact law; it imports nothing of the twin. `cases_twin` uses the twin itself. `cases` draws what
a case is, `size` says how visible it is, `observe` films it, `write` lays it out for ingest,
`score` judges answers, `python -m benchmarks.bank` runs a draw.
"""
