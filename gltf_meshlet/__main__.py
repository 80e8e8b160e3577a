"""Starts the command line. Ctrl-C exits silently, even during the slow imports."""

import gc
import os
import sys


def main() -> int:
    """Run the command line; returns the exit status."""
    # One thread for numpy's OpenBLAS, which multiplies only small matrices here: its threads spin
    # for 30 ms after import.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from gltf_meshlet import cli

        cli.report_cut_files()
        return cli.main()
    except KeyboardInterrupt:
        return 130
    finally:
        # Python searches all objects for cycles when it exits, which takes 20 ms.
        gc.freeze()


if __name__ == "__main__":
    sys.exit(main())
