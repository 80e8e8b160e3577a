"""Ray tracing."""
