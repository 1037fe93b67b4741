"""python -m virtualrig: the command line."""

import sys

from virtualrig.cli import main

if __name__ == "__main__":
    sys.exit(main())
