"""EXT_meshlet_edgebreaker: how attributes become streams of integers, and come back."""
