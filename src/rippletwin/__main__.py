"""python -m rippletwin: the command line."""

import sys

from rippletwin.cli.program import main

if __name__ == "__main__":
    sys.exit(main())
