"""compress, decompress, inspect, verify, validate and load: what users call, a module for each."""
