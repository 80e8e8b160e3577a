"""compress, decompress, inspect, load and transcode: what users call, a module for each."""
