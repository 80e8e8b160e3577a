"""`gltf-meshlet gpu-check`: what a driver offers, and whether every path draws rightly on it."""
