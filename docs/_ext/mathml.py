"""Equations as MathML, made when the site is built: no script and no font has to be loaded from anywhere.

Sphinx has no such output of its own. docutils, on which it stands, has the converter from LaTeX.
"""

import re

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml

ONE = r"\s*<(m\w+)[^>]*>(?:(?!<m(?:under)?over).)*?</{}>"
LIMITS = re.compile(  # an accented letter with an index, taken for a sum with limits
    r"<munderover>(\s*<mi[^>]*>[^<]*</mi>)("
    + ONE.format(r"\3")
    + r")(\s*<mo stretchy[^>]*>[^<]*</mo>\s*)</munderover>",
    re.DOTALL,
)


def converted(latex: str, *, display: bool) -> str:
    """MathML of a formula; what cannot be read ends the build with the formula."""
    try:
        found = tex2mathml(latex, as_block=display)
    except Exception as error:
        raise ValueError(f"no MathML can be made of the formula {latex!r}: {error}") from error
    return LIMITS.sub(r'<msub><mover accent="true">\1\4</mover>\2</msub>', found)


def inline(translator: object, node: nodes.math) -> None:
    """A formula within a line."""
    translator.body.append(converted(node.astext(), display=False))
    raise nodes.SkipNode


def block(translator: object, node: nodes.math_block) -> None:
    """A formula of its own: it scrolls where the page is narrower."""
    translator.body.append(f'<div class="equation" tabindex="0">{converted(node.astext(), display=True)}</div>\n')
    raise nodes.SkipNode


def setup(app: object) -> dict[str, bool]:
    """Offer it as a way to show equations."""
    app.add_html_math_renderer("mathml", inline_renderers=(inline, None), block_renderers=(block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
