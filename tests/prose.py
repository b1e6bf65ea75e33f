"""Sentences in text: Markdown without code, tables and links; help texts of commands."""

from __future__ import annotations

import re
from dataclasses import dataclass

FENCE = re.compile(r"^(```|~~~|:::).*?^\1[ \t]*$", re.DOTALL | re.MULTILINE)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
END = re.compile(r"(?<=[.!?])[\"')*]*\s+(?=[\"'(*`]*[A-Z0-9`])")
ABBREVIATION = re.compile(r"\b(e\.g|i\.e|vs|cf|No|al|Fig|eq)\.")
WORD = re.compile(r"[^\s]*[A-Za-z0-9][^\s]*")
MARK = re.compile(r"^\s*([-*+]|\d+\.|>)\s+")


@dataclass(frozen=True)
class Measure:
    """How long the sentences of a text are, in words."""

    sentences: int
    median: float
    ninth: float  # nine of ten sentences are not longer


def paragraphs(markdown: str) -> list[str]:
    """The running text of a Markdown page: paragraphs and list items, without headings, tables and code."""
    text = FENCE.sub("\n\n", COMMENT.sub("\n", markdown))
    text = LINK.sub(lambda link: "" if link[0].startswith("!") else link[1], text)
    found: list[list[str]] = [[]]
    listed = True  # where a mark begins an item, and is not a sign inside a sentence
    for line in text.splitlines():
        blank = not line.strip() or re.match(r"\s*(\||#|---)", line)
        item = listed and MARK.match(line)
        if blank or item:
            found.append([])
        if not blank:
            found[-1].append((MARK.sub("", line) if item else line).strip())
        listed = bool(blank or item or (listed and line.startswith(" ")))
    return [" ".join(lines) for lines in found if lines]


def sentences(markdown: str) -> list[str]:
    """The sentences of a page. A name in code is one word."""
    found = []
    for paragraph in paragraphs(markdown):
        text = ABBREVIATION.sub(r"\1", re.sub(r"`[^`]*`", "`code`", paragraph))
        found += [each for each in END.split(text) if len(words(each)) > 2]
    return found


def words(sentence: str) -> list[str]:
    """The words of a sentence, numbers included."""
    return WORD.findall(sentence)


def measure(found: list[str]) -> Measure:
    """Median and ninetieth percentile of the words per sentence."""
    lengths = sorted(len(words(each)) for each in found) or [0]
    return Measure(len(found), lengths[(len(lengths) - 1) // 2], lengths[int(0.9 * (len(lengths) - 1))])
