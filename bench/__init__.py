"""Measurements: each module is one question; `python -m bench` lists them, `python -m bench NAME` answers one."""
