"""The command line `gltf-meshlet` and its demo. Sits above gltf_ext and the back ends."""

import time

STARTED = time.perf_counter()  # nearly the start of the command
