"""Measurements: each module with a `main` answers one question. See README.md."""
