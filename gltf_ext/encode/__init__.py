"""Encodes primitives in chunks: most in one, in memory; with `--max-memory`, large ones in many.

1. One pass over the vertices of a source finds the bounds of each attribute, and so the streams
   (`gltf_ext.sources.source`, `gltf_ext.attributes.streams`).
2. A second quantises them. Vertices become records: their integers and a hash of each float
   position, so that equal vertices are equal without numbers (`gltf_ext.attributes.records`).
3. A source in memory is one chunk, with the corners of its triangles. Of a larger one, triangles
   become records of their three corners; a k-d tree over a sample of them cuts space into chunks
   that fit memory, and records are written to the work file of their chunk (`primitive`, `chunks`).
4. Equal vertices of a chunk are joined, and it is made meshlets and pages (`without_levels`). Pages
   decode alone, so those of all chunks, one after the other, are the pages of the primitive.
5. With levels of detail, each chunk's groups are simplified once, with the vertices that other
   chunks share locked. The results are the records of the next level, which other chunks divide,
   so that former borders become inner. A chunk that is alone builds all further levels (`levels`).
6. Errors of a level that is built in chunks are measured to the level before and added to the
   errors below, an upper bound of the distance to level 0.
Work files have no names: they are gone when the process is, however it ends.
"""
