"""Pages of a PDF and what they say."""

from __future__ import annotations

import re
import zlib
from contextlib import suppress
from html.parser import HTMLParser


class _Text(HTMLParser):
    """Collects the text of a document, without its style sheet and images."""

    def __init__(self) -> None:
        super().__init__()
        self.parts: list[str] = []
        self.skip = False

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.skip = tag == "style"

    def handle_data(self, data: str) -> None:
        if not self.skip:
            self.parts.append(data)


def page_count(pdf: bytes) -> int:
    """Number of pages, from the page tree, which may lie in a compressed stream."""
    parts = [pdf]
    for stream in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", pdf, re.DOTALL):
        with suppress(zlib.error):
            parts.append(zlib.decompress(stream))
    counts = re.compile(rb"/Type\s*/Pages\b[^>]*?/Count (\d+)|/Count (\d+)[^>]*?/Type\s*/Pages\b")
    return max(int(count) for part in parts for pair in counts.findall(part) for count in pair if count)


def text(html: str) -> str:
    """The text of an HTML document in one line."""
    parser = _Text()
    parser.feed(html)
    return " ".join(" ".join(parser.parts).split())


def pages(html: str) -> list[str]:
    """The text of each page that the document is laid out on, in one line."""
    from weasyprint import HTML

    return [" ".join(" ".join(box.text for box in page._page_box.descendants() if hasattr(box, "text")).split())
            for page in HTML(string=html).render().pages]
