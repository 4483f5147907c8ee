"""Formulas in plain text, as docstrings and sheets have them, typeset: F = K δ^p (1 + a δ̇/δ̇⁻).

An indented block all of whose lines are formulas becomes MathML. What cannot be read as one stays as it is written.
"""

import re
import unicodedata

from docutils import nodes
from mathml import converted

UPPER = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻ᵀᵗᵖⁿʳᵈᴴ", "0123456789+-TtpnrdH")
LOWER = str.maketrans("₀₁₂₃₄₅₆₇₈₉₊₋ₐₑᵢⱼₖₗₘₙₚᵣₛₜₓ", "0123456789+-aeijklmnprstx")
ACCENTS = {"\u0307": "dot", "\u0308": "ddot", "\u0302": "hat", "\u0304": "bar"}
FUNCTIONS = set(
    re.findall(r"\w+", "sin cos tan sinh cosh tanh exp ln log arccos arcsin arctan max min diag sign Re Im det")
)
SHORT = set(re.findall(r"\w+", "is in of or if to on at by up as it no lo hi Hz"))  # other pairs are products: EI, dt
NAMES = r"\int \oint \sum \ne \le \ge \propto \infty \sim \mp \Vert \approx \to \in \pm \times \cdot \ldots \ast"
SIGNS = {sign: f"{name} " for sign, name in zip("∫∮Σ≠≤≥∝∞~∓‖≈→∈±×·…*", NAMES.split(), strict=True)}
SIGNS |= {"<=": r"\le ", ">=": r"\ge ", "...": r"\ldots ", "%": r"\%", "−": "-", "–": "-", "ˣ": "^{x}"}
SIGNS |= {sign: rf"\tfrac{{1}}{{{part}}}" for sign, part in (("½", 2), ("¼", 4))} | {"¾": r"\tfrac{3}{4}"}
PRINTED = "sphx-glr-script-out"  # class of a script's output in the gallery
BRACKETS = {"(": ")", "{": "}"}
TOKEN = re.compile(
    r"""(?P<root>√)|(?P<raised>\^[({]?|_[({])|(?P<super>[⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻ᵀᵗᵖⁿʳᵈᴴ]+)|(?P<sub>[₀₁₂₃₄₅₆₇₈₉₊₋ₐₑᵢⱼₖₗₘₙₚᵣₛₜₓ]+)
    |_(?P<index>[A-Za-z0-9α-ωΑ-Ω]+)|(?P<number>\d+(?:\.\d+)?(?:e-?\d+)?)|(?P<accent>[A-Za-zα-ωΑ-Ω][\u0307\u0308\u0302\u0304])
    |(?P<name>[A-Za-zè-ÿ]{3,}(?:_[a-z]{2,})+)|(?P<word>[A-Z][a-z]+–[A-Z][a-z]+|[A-Za-z]+(?:-[a-z]+)?)|(?P<gap>\s{2,})|(?P<space>\s)|(?P<prime>'+)
    |(?P<sign><=|>=|\.\.\.|[*%…−∫∮Σ½¼¾ˣ≠≤≥∝∞~∓‖–≈→∈±×·])|(?P<other>[α-ωΑ-Ωϕϑξ()\[\]|+\-/=<>,;:.∂∇!])""",
    re.VERBOSE,
)
SIMPLE = r"-?\d+(?:[./]\d+)?|[¼½¾∞]|-?Δ?[A-Za-zα-ωΑ-Ω][\u0307\u0308]?(?:_\w+|[₀-₉]+)?\*?"
RELATION = re.compile(r"[=<>≤≥≈∝]")
CODE = re.compile(r"""[`"#$@\\]|>>>|->|::|==|\bdef\b|\bimport\b|\w\(\w+=|^\s*\||[─│┌]""")


def latex(line: str) -> str | None:
    """LaTeX of one line, or None where it is no formula."""
    text, place, parts = decomposed(line), 0, []
    while place < len(text):
        found = TOKEN.match(text, place)
        if not found:
            return None
        place = found.end()
        if found.lastgroup not in ("root", "raised"):
            parts.append(piece(found.lastgroup, found[found.lastgroup]))
            continue
        start, end, place = argument(text, place, found[0])
        inner = latex(text[start:end]) if end > start else None
        if not inner:
            return None
        parts.append(script(found[0], inner))
    joined = re.sub(r"(?<=[A-Za-z]) \}\s*\\text\{ ", " ", "".join(parts))  # words beside each other are one text
    return re.sub(r" \}(?=[,.;:)])", "}", joined).strip()


def decomposed(line: str) -> str:
    """Letters apart from their accents."""
    return "".join(unicodedata.normalize("NFD", sign) if sign.isalpha() else sign for sign in line)


def script(sign: str, inner: str) -> str:
    """A root, an exponent, or an index, whose brackets are kept."""
    if sign == "√":
        return rf"\sqrt{{{inner}}}"
    return f"{sign[0]}{{({inner})}}" if sign == "_(" else f"{sign[0]}{{{inner}}}"


def argument(text: str, start: int, sign: str) -> tuple[int, int, int]:
    """Where what a root or an exponent holds begins and ends, and where to go on; empty if it is none."""
    opened = sign[-1] if sign[-1] in BRACKETS else text[start : start + 1] if sign == "√" else ""
    if opened in BRACKETS and opened:
        start += sign == "√"
        end = closing(text, start, opened)
        return start, end, end + 1
    found = re.compile(SIMPLE).match(text, start)
    end = found.end() if found else start
    return start, end, end


def closing(text: str, start: int, opened: str) -> int:
    """Where the bracket that was opened before `start` is closed; `start` if it is not."""
    depth = 1
    for place in range(start, len(text)):
        depth += (text[place] == opened) - (text[place] == BRACKETS[opened])
        if not depth:
            return place
    return start


def piece(kind: str, value: str) -> str:
    """LaTeX of one token."""
    if kind in ("super", "sub"):
        return ("^{" if kind == "super" else "_{") + value.translate(UPPER if kind == "super" else LOWER) + "}"
    if kind == "index":
        upright = len(value) > 1 and value.isascii() and value.isalpha()
        return rf"_{{\mathrm{{{value}}}}}" if upright else f"_{{{value}}}"
    if kind == "accent":
        return rf"\{ACCENTS[value[1]]}{{{value[0]}}}"
    if kind == "name":
        return r"\mathrm{" + value.replace("_", r"\_") + "}"
    if kind == "word":
        return word(value)
    return {"gap": r"\quad ", "space": " ", "sign": SIGNS.get(value)}.get(kind, value)


def word(value: str) -> str:
    """Letters: a symbol, a product of two, a function, or a word."""
    if value in FUNCTIONS:
        return rf"\mathrm{{{value}}}\,"
    if len(value) < 3 and value not in SHORT:
        return " ".join(value)
    return rf"\text{{ {value} }}"


def formula(text: str) -> str | None:
    """LaTeX of a block, or None."""
    lines = text.splitlines()
    if CODE.search(text) or not RELATION.search(text) or any(CODE.search(line) for line in lines):
        return None
    rows = [[latex(cell) for cell in re.split(r"\s{3,}", line.strip())] for line in lines if line.strip()]
    if any(cell is None for row in rows for cell in row) or wordy(rows):
        return None
    if len(rows) == 1 or len({len(row) for row in rows}) > 1:  # nothing stands below each other
        return r" \quad ".join(cell for row in rows for cell in row)
    return r"\begin{matrix} " + r" \\ ".join(" & ".join(row) for row in rows) + r" \end{matrix}"


def wordy(rows: list[list[str]]) -> bool:
    """Whether it is words for the most part: a table of names, or a sentence."""
    text = "".join("".join(row) for row in rows)
    words = "".join(re.findall(r"\\text\{([^}]*)\}", text))
    whole = re.sub(r"\\[a-z]+|[\s{}^_]", "", text)
    return len(words.replace(" ", "")) > 0.7 * len(whole)


def readable(found: str) -> bool:
    """Whether the converter knows all of it."""
    try:
        return bool(converted(found, display=True))
    except ValueError:
        return False


def typeset(app: object, document: nodes.document) -> None:
    """Put formulas in place of the indented blocks of a page that are some; what a script has printed is none."""
    for block in list(document.findall(nodes.literal_block)):
        plain = block.get("language", "none") == "none" and PRINTED not in block["classes"]
        found = formula(block.astext()) if plain else None
        if found and readable(found):
            block.replace_self(nodes.math_block(found, found, nowrap=True, number=None, label=None))


def setup(app: object) -> dict[str, bool]:
    """Called once for each page that is read."""
    app.connect("doctree-read", typeset)
    return {"parallel_read_safe": True}
