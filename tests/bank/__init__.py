"""Tests of the bank of hidden-effect cases (`benchmarks.bank`), and its reduced draw, diagnosed."""
