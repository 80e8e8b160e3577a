"""Many models at once: a task a file, on Dask distributed."""
