"""The estimator: it observes a system's runs and fits what is unknown of it.

`parameters` says what may be fitted; `system` what a system has to offer, `systems/` the hopping
robot and any MJCF. `observer` simulates runs and corrects the state after every sample
(`correction`), with the covariance of `gain`; `estimator` states the likelihood and gives residuals
and derivatives; `drive` turns the seen rotor into an input. Nothing here knows of a diagnosis, a
report or a command line.
"""
