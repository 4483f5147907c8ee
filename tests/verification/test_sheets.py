"""Verification sheets: errors within what is allowed, pages that say what is computed."""

import pytest
import sheets
from matplotlib.figure import Figure
from sheets import PAGES, SHEETS, Row

BY_CHANCE = {"moon_shaw", "white_noise"}  # a row of theirs follows a chaotic response


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.chaotic] * (n in BY_CHANCE)) for n in SHEETS])
def test_sheet(name):
    """Every number is as the published formula gives it; its page is current, and its figure can be drawn."""
    for row in sheets.rows(name):
        assert row.error <= row.allowed, f"{row.quantity}: {row.ours!r}, formula {row.formula!r}"
    renew = f"{sheets.COMMAND} {name} --write"
    assert sheets.current((PAGES / f"{name}.md").read_text(encoding="utf-8"), sheets.page(name)), renew
    listed = [line for line in (PAGES / "index.md").read_text(encoding="utf-8").splitlines() if f"]({name}.md)" in line]
    assert len(listed) == 1
    assert sheets.current(listed[0], sheets.line(sheets.summary(name))), renew
    sheets.sheet(name).draw(*Figure().subplots(1, 2))
    assert (PAGES / f"{name}.png").is_file()


def test_every_page_has_its_sheet():
    assert {path.stem for path in PAGES.glob("*.md")} == {"index", "codes", *SHEETS}
    assert {path.stem for path in PAGES.glob("*.png")} == {*SHEETS}


@pytest.mark.parametrize(
    ("written", "made", "same"),
    [
        ("| ω | 1.2345678 | < 1e-09 | 1e-06 |", "| ω | 1.2345679 | 2.1e-09 | 1e-06 |", True),
        ("| ω | 1.2345678 | 2.0e-07 | 1e-06 |", "| ω | 1.2345678 | 2.5e-07 | 1e-06 |", True),
        ("| ω | 1.2345678 | 2.0e-07 | 1e-06 |", "| ω | 1.2345678 | 8.0e-07 | 1e-06 |", False),
        ("| ω | 1.2345678 | 2.0e-07 | 1e-06 |", "| ω | 1.2346678 | 2.0e-07 | 1e-06 |", False),
        ("| ω | 1.2345678 | 2.0e-07 | 1e-06 |", "| λ | 1.2345678 | 2.0e-07 | 1e-06 |", False),
        ("| λ | 0.0597 | 0.0583 | 2.3e-02 | 4e-01 |", "| λ | 0.0632 | 0.0570 | 1.0e-01 | 4e-01 |", True),
    ],
)
def test_pages_are_compared_up_to_rounding(written, made, same):
    assert sheets.current(written, made) == same


def test_an_error_is_relative_to_the_formula():
    assert Row("ω", 2.0, 2.002, 1e-2).error == pytest.approx(1e-3)
    assert sheets.cells(Row("ω", 2.0, 2.0, 1e-2, "2.1"), True)[-3:] == ["5.0e-02", "< 1e-09", "1e-02"]
