"""Texts that name policies, read once into a tree: source, name, options, and the policies inside them."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import unquote

from cps_envs.core.declare.panel import MIXTURE
from cps_envs.core.documents import typed
from cps_envs.core.errors import ConfigurationError, shown

MOST_DEPTH = 20  # of policies inside one another
OPTION = re.compile(r"[A-Za-z_][\w.-]*=")  # how a name=value pair begins
ARCHIVE = re.compile(rf"\.zip\?(?={OPTION.pattern})")  # a file's name in front of one, whose value may be a path
DECODER = json.JSONDecoder()


@dataclass(frozen=True)
class Reference:
    """A policy as a text names it.

    `policies` are the texts in an option `policies`, such as those of a mixture, and every other text in the options
    that begins with a registered source, such as `"zoo:mine"`.
    """

    text: str
    source: str  # registered, such as "zoo"; of "module:attribute" the module; empty for a registered policy
    name: str  # behind the source
    options: Mapping[str, Any] = field(default_factory=dict)
    policies: tuple[Reference, ...] = ()

    @property
    def title(self) -> str:
        """The text without its options."""
        return f"{self.source}:{self.name}" if self.source else self.name

    @property
    def is_mixture(self) -> bool:
        """Whether it draws one of its policies for each episode."""
        return not self.source and self.name.rpartition(".")[2] == MIXTURE

    def walk(self) -> Iterator[Reference]:
        """This policy and all inside it."""
        yield self
        for each in self.policies:
            yield from each.walk()

    def with_option(self, name: str, value: object) -> str:
        """The text with one more option at its end."""
        return f"{self.text}{'&' if self.options else '?'}{name}={value}"


def parse_reference(text: str, sources: Collection[str] = (), depth: int = 0) -> Reference:
    """The tree of a text such as `name?option=value&option=value`, `module:attribute` or `zoo:FOLDER?seed=1`.

    Values are read as JSON where possible. A value that begins as JSON ends where the JSON does, so that an `&` inside
    it separates nothing; `%26` and the like are decoded. Behind one of the registered `sources` the name may be a path:
    its options begin at the first question mark behind `.zip`, else behind the last `/`, that name=value pairs follow.

    Raises:
        ConfigurationError: options that are no name=value pairs, are given twice, or hold policies that are nested too
            deeply.
    """
    if depth > MOST_DEPTH:
        raise ConfigurationError(f"policies are nested too deeply in one another, in {shown(text, 40)}")
    title, query = _parted(text, sources)
    source, _, name = title.partition(":")
    options = _options(query) if query is not None else {}
    found = tuple(parse_reference(each, sources, depth + 1) for each in _inner(options, sources))
    has_source = bool(source and name)
    return Reference(text, source if has_source else "", name if has_source else title, options, found)


def texts_in(value: Any) -> Iterator[str]:
    """Every text in a value of JSON, names of entries aside."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, (list, tuple, dict)):
        for each in value.values() if isinstance(value, dict) else value:
            yield from texts_in(each)


def _parted(text: str, sources: Collection[str]) -> tuple[str, str | None]:
    """What is in front of the options, and the options, if there are any."""
    if not _is_sourced(text, sources):
        title, mark, query = text.partition("?")
        return title, query if mark else None
    if archive := ARCHIVE.search(text):
        return text[: archive.end() - 1], text[archive.end() :]
    place = text.rfind("/")
    while (place := text.find("?", place + 1)) >= 0:
        if OPTION.match(text, place + 1):
            return text[:place], text[place + 1 :]
    return text, None


def _options(query: str) -> dict[str, Any]:
    """The values of name=value&name=value."""
    found: dict[str, Any] = {}
    place = 0
    while query and place <= len(query):
        name, equals, _ = query[place:].partition("=")
        if not (name and equals) or "&" in name:
            raise ConfigurationError(f"options are written as name=value&name=value, not {shown(query, 80)}")
        start = place + len(name) + 1
        end = _end(query, start)
        name = unquote(name)
        if name in found:
            raise ConfigurationError(f"the option {name!r} is given twice in {shown(query, 80)}: leave one out")
        try:
            found[name] = typed(unquote(query[start:end]))
        except ValueError as error:
            beginning = query[start : start + 20]
            raise ConfigurationError(f"an option of a policy makes no sense, {error}: {beginning}...") from error
        place = end + 1
    return found


def _end(query: str, start: int) -> int:
    """Where a value ends that begins at `start`."""
    if query[start : start + 1] in ("[", "{", '"'):
        try:
            _, end = DECODER.raw_decode(query, start)
        except (ValueError, RecursionError):
            pass
        else:
            if query[end : end + 1] in ("", "&"):
                return end
    end = query.find("&", start)
    return len(query) if end < 0 else end


def _inner(options: Mapping[str, Any], sources: Collection[str]) -> Iterator[str]:
    """The policies that options name."""
    for name, value in options.items():
        for text in texts_in(value):
            listed = name == "policies" and isinstance(value, list) and text in value
            if listed or _is_sourced(text, sources):
                yield text


def _is_sourced(text: str, sources: Collection[str]) -> bool:
    source, colon, _ = text.partition(":")
    return bool(colon) and source in sources
