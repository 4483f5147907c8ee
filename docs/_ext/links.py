"""Check a built site: every link within it leads to a file that is there, and to an anchor in that file.

`python docs/_ext/links.py FOLDER` prints what leads nowhere; the exit code is 1 if anything does.
"""

import re
import sys
from functools import cache
from html import unescape
from pathlib import Path
from urllib.parse import unquote, urlsplit

LINK = re.compile(r'(?:href|src)="([^"]+)"')
NAME = re.compile(r'\bid="([^"]+)"')


@cache
def anchors(page: Path) -> set[str]:
    """What can be linked to within a page."""
    return {unescape(name) for name in NAME.findall(page.read_text(encoding="utf-8"))}


def leads(page: Path, link: str) -> bool:
    """Whether a link of a page leads somewhere; those that leave the site are taken for good."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return True
    target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
    target = target / "index.html" if target.is_dir() else target
    if not target.exists() or target.suffix != ".html" or not parts.fragment:
        return target.exists()
    return unquote(parts.fragment) in anchors(target)


def broken(page: Path) -> list[str]:
    """Links of a page that lead nowhere."""
    links = map(unescape, LINK.findall(page.read_text(encoding="utf-8")))
    return [link for link in links if not leads(page, link)]


def report(folder: Path) -> int:
    """Print them all; how many there are."""
    pages = [page for page in sorted(folder.rglob("*.html")) if "_static" not in page.parts]
    lost = [f"{page.relative_to(folder)}: {link}" for page in pages for link in broken(page)]
    print(f"{len(pages)} pages, {len(lost)} links lead nowhere", *lost, sep="\n")
    return len(lost)


if __name__ == "__main__":
    sys.exit(bool(report(Path(sys.argv[1]).resolve())))
