"""Run a campaign: ``python -m tests.campaign kill|commit|concurrent|fuzz|stale``."""

import argparse
import sys
from importlib import import_module

NAMES = ("kill", "commit", "concurrent", "fuzz", "stale")


def main() -> int:
    """Return 0 if the campaign found no fault."""
    parser = argparse.ArgumentParser(prog="python -m tests.campaign", description=__doc__)
    parser.add_argument("name", choices=NAMES)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    return int(import_module(f"tests.campaign.{args.name}").run(args.count, args.seed))


if __name__ == "__main__":
    sys.exit(main())
