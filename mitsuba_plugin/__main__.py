"""`python -m mitsuba_plugin`, what `gltf-meshlet render` runs."""

import argparse
import sys

from .render import add_arguments, main

parser = argparse.ArgumentParser(
    prog="python -m mitsuba_plugin", description=sys.modules["mitsuba_plugin.render"].__doc__
)
add_arguments(parser)
sys.exit(main(parser.parse_args()))
