"""Compressing, decompressing and inspecting the primitives of a glTF document."""
