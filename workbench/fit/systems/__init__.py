"""The systems that can be fitted: each says how to build, drive and observe itself.

`hopper` is the curved-beam robot; `mjcf` any MJCF with hinges and slides, with `mjcf_runs` for what
was measured of it, `mjcf_parameters` for what may be fitted and `mjcf_model` for its linearisation.
A new system is a file that offers what `fit.system.System` asks; one more number of an MJCF to
be fitted is an entry of `mjcf_parameters.FIELDS`.
"""
