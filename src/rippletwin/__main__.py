"""python -m rippletwin: the command line."""

import sys

from rippletwin.cli import main

sys.exit(main())
