"""Measurements: each module is one question, run as `python -m bench.NAME` from the repository root."""
