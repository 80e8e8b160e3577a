"""Compresses, decompresses, inspects and verifies the primitives of a glTF document."""
