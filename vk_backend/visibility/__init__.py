"""The path that rasterises with compute shaders."""
