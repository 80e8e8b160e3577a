"""Triangles from glTF, OBJ, PLY and STL: rows of vertices and corners, in memory or in files."""
