"""Reads and writes glTF files. Knows nothing about compression."""
