"""The systems that can be fitted: each says how to build, drive and observe itself.

`hopper` is the curved-beam robot, `mjcf` any mechanism of hinges and slides: its parameters are
edits of the MJCF file (`mjcf_parameters`; `mjcf_fields`: of which numbers), its runs and channels
in `mjcf_runs`, its linearisation in `mjcf_model`. A new system is a file that offers what
`fit.system.System` asks.
"""

__all__: list[str] = []
