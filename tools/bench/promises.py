"""What the keys of a recipe promise to be seen, and whether it is: the table of docs/promises.md.

Run it from the checkout: ``python -m tools.bench.promises [--write] [KEY ...]``.

A promise is a sentence of a key's text in docs/recipe.md. For each, the fire is made with a low and
a high value that an artist would use, and with the key left out, over four seeds. The figure that
the sentence is about is measured on tracks or pixels. It is seen if from low to high it goes the
promised way by more than twice the spread of the seeds (the largest difference between two of them
at one value), and by at least what ``Unit`` says.

To add one: a ``Promise`` in ``of_effect``, ``of_profile``, ``of_silk`` or ``of_fluid``. The test
``tests/docs/test_promises.py`` checks the sentences and, small and with one seed, the directions;
``--write`` writes the page.
"""

import argparse
import sys

from tests.support.promises.table import ALL, PAGE, Kept, page

parser = argparse.ArgumentParser()
parser.add_argument(
    "keys",
    nargs="*",
    metavar="KEY",
    help="only these, or those of `clip`, `profile`, `silk` or `fluid`",
)
parser.add_argument("--write", action="store_true", help="write docs/promises.md")
args = parser.parse_args()
rows = []
for promise in ALL:
    if not args.keys or promise.fire in args.keys or promise.key in args.keys:
        rows.append(Kept.of(promise))
        print(rows[-1].row(), flush=True)
if args.write and not args.keys:
    PAGE.write_text(page(rows), encoding="utf-8")
sys.exit(not all(each.is_seen for each in rows))
