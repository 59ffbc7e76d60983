"""Diagnosis: what the simulation gets wrong, by which cause, how surely, and what is gained."""
