"""`python -m pronk_pin`: the command line, where the script is not installed."""

import sys

from .cli import main

sys.exit(main())
