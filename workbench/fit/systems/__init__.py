"""The systems that can be fitted: each says how to build, drive and observe itself.

`hopper` is the curved-beam robot; a new system is a file that offers what `fit.system.System` asks.
"""
