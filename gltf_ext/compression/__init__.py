"""EXT_meshlet_edgebreaker: streams, primitives, and the options of `compress`."""
