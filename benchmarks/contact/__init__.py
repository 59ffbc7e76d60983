"""References for the ground law: two solvers of the planar robot that share no code with the twin.

`chain` has the equations of motion, `events` solves them with exact sticking and located changes
of state, `stepping` by Moreau and Jean's scheme, which has no states. `python -m
benchmarks.contact` compares both with the twin, and prints how far each reading of the law hops.
"""
