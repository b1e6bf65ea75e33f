"""The readme of the package: README.md, whose relative links lead to the repository."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

REPOSITORY = "https://github.com/cps-envs/cps-envs/blob/main/"
IMAGES = "https://raw.githubusercontent.com/cps-envs/cps-envs/main/"


class ReadmeHook(MetadataHookInterface):
    """Fills in `project.readme`."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Called by hatchling when it builds a wheel or an archive of the sources."""
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": absolute(text)}


def absolute(markdown: str) -> str:
    """A page with its relative links made absolute."""
    images = re.sub(r"(!\[[^]]*\]\()(?!https?:|#)", rf"\1{IMAGES}", markdown)
    return re.sub(r"((?<!!)\[[^]]*\]\()(?!https?:|#)", rf"\1{REPOSITORY}", images)
