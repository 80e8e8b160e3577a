"""Vulkan back end: draws and traces files with EXT_meshlet_edgebreaker straight from their compressed bytes."""
