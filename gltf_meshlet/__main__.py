"""Starts the command line. Ctrl-C exits silently, even during the slow imports."""

import sys


def main() -> int:
    """Run the command line; returns the exit status."""
    try:
        from gltf_meshlet import cli

        return cli.main()
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
