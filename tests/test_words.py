"""What users read is plain: short sentences, words that are explained, none of the phrases that send readers back."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

FENCE = re.compile(r"^(```|~~~|:::).*?^\1[ \t]*$", re.DOTALL | re.MULTILINE)
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
SCORES = re.compile(r"<!-- scores.*?<!-- /scores -->", re.DOTALL)  # columns of the leaderboard
LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
END = re.compile(r"(?<=[.!?])[\"')*]*\s+(?=[\"'(*`]*[A-Z0-9`])")
ABBREVIATION = re.compile(r"\b(e\.g|i\.e|vs|cf|No|al|Fig|eq)\.")
WORD = re.compile(r"[^\s]*[A-Za-z0-9][^\s]*")
MARK = re.compile(r"^\s*([-*+]|\d+\.|>)\s+")
ROOT = Path(__file__).parents[1]
GENERATED = {
    "leaderboard.md",
    "reliability.md",
    "changelog.md",
    "contributing.md",
    "security.md",
}
DOCUMENTS = [page for page in sorted((ROOT / "docs").rglob("*.md")) if page.name not in GENERATED]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md", *DOCUMENTS]
FOR_DEVELOPERS = {"architecture.md", "api.md", "developers.md", "reliability.md", "changelog.md"}
FOR_DEVELOPERS |= {
    "contributing.md",
    "security.md",
    "speed.md",
    "leaderboard.md",
}  # the leaderboard is looked up, not read
MOST_WORDS = 30_000  # of running text on the pages for users, README included
LONGEST = 2_800  # words of a page
LATER: set[str] = set()
MEDIAN, NINTH = 17, 27  # words in a sentence: half are below 18, and nine of ten are not longer than this
OPTION = 100  # characters in the help of an option
WORDS_OF_OURS = {  # what the field calls otherwise, and what to write instead
    r"\b(is|are|be|was|were|gets?) paid\b|\bpays\b|\bpays? (the|it|them|for)\b|\bthe pay\b": "return, or concedes",
    r"\btold\b(?!=)": "privileged, or knows",
    r"\bbest (known )?(answers?|replies|reply)\b|\banswers known\b": "best responses",
    r"\bboards?\b": "leaderboard",
    r"\bdoors?\b": "interface",
    r"\bdays that teach\b|\bdays to practise\b": "training episodes",
    r"\b(best|no) constants?\b(?! action)": "constant action",
    r"\bsearched\b": "tuned by search",
    r"\bsurely\b": "an interval, or significantly",
    r"\banew\b": "again",
    r"\bstands? -": "a dash means",
}
OURS = re.compile(r"\b(E_v|A_impact|MTD[12]|venue|contestant|onset|seat|privileged|swarm|informed)\b")
RIDDLES = re.compile(
    r"nothing runs along|whose merit|\blest\b|reads beside|as the bar|\blives? on\b|would be too near|goes? upon|"
    r"comes? upon|beat the bar|hands? on its|aught|whereupon|\bthither\b|\bnought\b",
    re.IGNORECASE,
)


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


def private(text: str) -> dict[str, str]:
    """The private words of a text outside names in code, and what to write instead."""
    plain = re.sub(r"```.*?```|`[^`\n]*`|\]\([^)]*\)|https?://\S+", " ", SCORES.sub("", text), flags=re.DOTALL)
    plain = COMMENT.sub("", plain)
    return {
        found[0]: instead for bad, instead in WORDS_OF_OURS.items() if (found := re.search(bad, plain, re.IGNORECASE))
    }


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_sentences_of_a_page_are_short(page: Path) -> None:
    found = sentences(page.read_text(encoding="utf-8"))
    measured = measure(found)
    longest = max(found, key=lambda sentence: len(words(sentence)), default="")
    assert measured.median <= MEDIAN, f"{measured}, the longest: {longest}"
    assert measured.ninth <= NINTH, f"{measured}, the longest: {longest}"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_a_page_with_words_of_ours_links_to_the_glossary(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    ours = OURS.findall(" ".join(paragraphs(text)))
    assert not ours or page.name == "glossary.md" or "glossary.md" in text, sorted(set(ours))


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_a_page_uses_the_words_of_the_field(page: Path) -> None:
    """Also in its tables, but not in code and names."""
    assert page.name in LATER or not private(page.read_text(encoding="utf-8"))


def test_pages_for_users_are_short_enough_to_be_read() -> None:
    pages = [ROOT / "README.md", *(page for page in (ROOT / "docs").rglob("*.md") if page.name not in FOR_DEVELOPERS)]
    count = {
        name(page): sum(len(words(each)) for each in paragraphs(page.read_text(encoding="utf-8"))) for page in pages
    }
    longest = sorted(count.items(), key=lambda item: -item[1])[:5]
    assert longest[0][1] <= LONGEST, longest
    assert sum(count.values()) <= MOST_WORDS, f"{sum(count.values())} words; the longest pages: {longest}"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_no_page_speaks_in_riddles(page: Path) -> None:
    found = RIDDLES.findall(" ".join(paragraphs(page.read_text(encoding="utf-8"))))
    assert not found


def commands() -> list[tuple[str, Any]]:
    """Every command of the command line with its name."""
    pytest.importorskip("typer", reason="needs the command line")
    from cps_agents.cli import whole

    found: list[tuple[str, Any]] = []

    def walk(path: str, command: Any) -> None:
        for part, each in getattr(command, "commands", {}).items():
            walk(f"{path} {part}".strip(), each)
        found.append((path, command))

    walk("", whole())
    return found


def test_help_is_short_and_begins_with_a_summary() -> None:
    texts = []
    for path, command in commands():
        text = inspect.cleandoc(command.help or "")
        first = text.partition("\n\n")[0]
        assert re.match(r"[A-Z].*[.?]$", first), path
        assert len(first) <= OPTION, f"{path}: {first}"
        texts += sentences(text)
    measured = measure(texts)
    assert measured.median <= MEDIAN, measured
    assert measured.ninth <= NINTH, measured


def test_help_uses_the_words_of_the_field() -> None:
    for path, command in commands():
        texts = [command.help or "", *(getattr(each, "help", None) or "" for each in command.params)]
        assert path.startswith("score") or not private("\n".join(texts)), path


@pytest.mark.parametrize("package", ["cps_envs", "cps_agents", "cps_baselines"])
def test_public_docstrings_use_the_words_of_the_field(package: str) -> None:
    """Of what user code imports, with the methods that it calls."""
    module = pytest.importorskip(package)
    for each in set(module.__all__) - {"score"}:  # is written again with the leaderboard
        value = getattr(module, each)
        members = [one for name, one in vars(value).items() if name[0] != "_"] if inspect.isclass(value) else []
        documented = [
            value,
            *(member for member in members if inspect.isroutine(member) or isinstance(member, property)),
        ]
        texts = [inspect.getdoc(one) or "" for one in documented if not isinstance(one, (str, dict, tuple))]
        assert not private("\n".join(texts)), each


def test_help_of_an_option_is_a_line() -> None:
    for path, command in commands():
        for parameter in command.params:
            text = getattr(parameter, "help", None) or ""
            assert len(text) <= OPTION, f"{path} {parameter.name}: {text}"


def test_sentences_are_found() -> None:
    page = "# Title\n\nOne [link](a.md) here. Two: `a b c` and k\n+ 1 more.\n\n- An item\n  goes on.\n\n| a |\n|---|\n"
    assert sentences(page) == ["One link here.", "Two: `code` and k + 1 more.", "An item goes on."]
    assert measure(["a b c", "a b c d"]) == Measure(2, 3, 3)
