"""The scene of a file, on the host and on the device."""
