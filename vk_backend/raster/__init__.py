"""The paths with a graphics pipeline."""
