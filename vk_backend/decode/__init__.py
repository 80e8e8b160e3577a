"""Compute shaders decode meshlets into slots."""
