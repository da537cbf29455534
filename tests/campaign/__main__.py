"""Run one campaign, print every fault it finds, and exit with 1 if there are any.

A campaign is a module with ``run(count, seed)``, which returns a line for each fault. ``count`` is
how often it tries; without one, as often as the campaign itself thinks right.
"""

import argparse
import sys
from importlib import import_module

CAMPAIGNS = {
    "kill": "kills",
    "commit": "commits",
    "disk": "disks",
    "exchange": "exchanged",
    "limit": "limits",
    "watch": "watches",
    "concurrent": "concurrent",
    "power": "power",
    "fuzz": "fuzz",
    "stale": "stale",
    "cache": "cache",
    "agree": "agreement",
}
"""The module of each campaign."""


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.campaign", description=__doc__)
    parser.add_argument("campaign", choices=CAMPAIGNS)
    parser.add_argument("--count", type=int)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    faults = import_module(f".{CAMPAIGNS[args.campaign]}", __package__).run(args.count, args.seed)
    print(*faults, f"{args.campaign}: {len(faults)} faults, seed {args.seed}", sep="\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
