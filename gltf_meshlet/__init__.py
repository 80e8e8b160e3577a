"""The command line `gltf-meshlet` and its demo. Sits above gltf_ext and the back ends."""
