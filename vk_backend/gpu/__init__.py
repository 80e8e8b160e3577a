"""A device and what lives on it: memory, images, pipelines. Knows nothing of glTF."""
