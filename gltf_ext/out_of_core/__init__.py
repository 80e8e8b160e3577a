"""Compresses primitives that are larger than memory, in chunks, for `compress --max-memory`.

1. One pass over the vertices finds the bounds of each attribute, and so the grids (`sources`).
2. A second quantises them. Triangles become records with the integers of their three corners and
   a hash of each float position, so that equal vertices are equal without numbers (`records`).
3. A k-d tree over a sample of the triangles cuts space into chunks that fit memory; records are
   written to the work file of their chunk (`chunks`).
4. Each chunk is made a small primitive, meshlets and pages of level 0 (`encoding`). Pages decode
   alone, so those of all chunks, one after the other, are the pages of the primitive.
5. With levels of detail, each chunk's groups are simplified once, with the vertices that other
   chunks share locked. The results are the records of the next level, which other chunks divide,
   so that former borders become inner. Once a level fits memory, today's builder ends (`levels`).
6. Errors of a level that is built in chunks are measured to the level before and added to the
   errors below, an upper bound of the distance to level 0.
Work files have no names: they are gone when the process is, however it ends.
"""
