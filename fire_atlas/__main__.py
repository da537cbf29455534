"""``python -m fire_atlas``: the same as the command ``fire-atlas``."""

import sys

from fire_atlas.cli import main

if __name__ == "__main__":
    sys.exit(main())
