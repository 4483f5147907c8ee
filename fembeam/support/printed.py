"""Results that print as text and show as tables of HTML in notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

from fembeam.support.text_tables import aligned, cell

Part = str | tuple[Sequence[str], Sequence[Sequence[Any]]]  # a sentence, or a table as (head, rows)


class Printed:
    """What has parts: sentences and tables, the same ones in print and in a notebook."""

    def _parts(self) -> list[Part]:
        """What there is to show, from top to bottom."""
        raise NotImplementedError

    def __str__(self) -> str:
        return "\n".join(part if isinstance(part, str) else aligned(*part) for part in self._parts())

    def _repr_html_(self) -> str:
        return "\n".join(_html(part) for part in self._parts())


def _html(part: Part) -> str:
    """One part."""
    return f"<p>{escape(part)}</p>" if isinstance(part, str) else html_table(*part)


def html_table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    r"""A table that scrolls sideways where the screen is narrow.

    Examples
    --------
    >>> html_table(["", "m"], [["u & v", 0.1]])
    '<div class="wide"><table><tr><th></th><th>m</th></tr>\n<tr><td>u &amp; v</td><td>0.1</td></tr></table></div>'
    """
    lines = ["".join(f"<th>{escape(str(name))}</th>" for name in head)]
    lines += ["".join(f"<td>{escape(cell(value, '–'))}</td>" for value in row) for row in rows]
    return '<div class="wide"><table>' + "\n".join(f"<tr>{line}</tr>" for line in lines) + "</table></div>"
