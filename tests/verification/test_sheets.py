"""Verification sheets: errors within what is allowed, pages that say what is computed."""

import pytest
from matplotlib.figure import Figure
from sheets import PAGES, SHEETS, Row, current, index, page, rows, sheet


@pytest.mark.parametrize("name", SHEETS)
def test_sheet(name):
    """Every number is as the published formula gives it; its page is current, and its figure can be drawn."""
    for row in rows(name):
        assert row.error <= row.allowed, f"{row.quantity}: {row.ours!r}, formula {row.formula!r}"
    written = (PAGES / f"{name}.md").read_text(encoding="utf-8")
    assert current(written, page(name)), f"python tests/verification --write {name}"
    assert (PAGES / f"{name}.png").is_file()
    sheet(name).draw(*Figure().subplots(1, 2))


def test_the_list_of_sheets():
    """Its page names each, and is written again with `python tests/verification --write`."""
    written = (PAGES / "index.md").read_text(encoding="utf-8")
    assert all(f"]({name}.md)" in written for name in SHEETS)
    assert {path.stem for path in PAGES.glob("*.md")} == {"index", *SHEETS}
