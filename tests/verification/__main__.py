"""Print the numbers of verification sheets, or write the pages made from them.

python tests/verification [SHEET …] [--write]        all sheets, or those named
"""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent.parent))  # for `oscillators`

from sheets import PAGES, SHEETS, figure, index, page, table, title


def write(name):
    """The page of a sheet and its figure."""
    (PAGES / f"{name}.md").write_text(page(name), encoding="utf-8")
    figure(name).savefig(PAGES / f"{name}.png", dpi=90)


asked = [name for name in sys.argv[1:] if name != "--write"]
if unknown := [name for name in asked if name not in SHEETS]:
    sys.exit(f"no sheet {unknown[0]!r}; there are {', '.join(SHEETS)}")
for name in asked or SHEETS:
    print(f"{title(name)}\n{table(name)}\n")
    if "--write" in sys.argv:
        write(name)
if "--write" in sys.argv:
    (PAGES / "index.md").write_text(index(), encoding="utf-8")
