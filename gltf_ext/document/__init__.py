"""Reads and writes glTF files: JSON, buffers, accessors, images, nodes."""
