"""Compiles the shaders of measurements when this module is imported, if they are stale.

Modules that use the shaders import it first. Raises RuntimeError if a compiler is missing.
"""

from __future__ import annotations

from tools import build_shaders

if build_shaders.stale_modules("bench"):
    build_shaders.build("bench")
