"""`python -m pronk_pin.cli`, where the script is not installed."""

import sys

from . import main

sys.exit(main())
