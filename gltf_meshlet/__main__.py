"""Where the command line starts: imports take a while, and Ctrl-C during them is no error either."""

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
