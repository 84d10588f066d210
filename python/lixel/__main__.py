"""`python -m lixel` is `lixel`."""

import sys

from .cli import main

sys.exit(main())
