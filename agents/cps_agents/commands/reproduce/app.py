"""`cps-envs reproduce`: what the dissertation prints, computed by our code and put beside it."""

from __future__ import annotations

import typer

from cps_agents.commands.reproduce.chapter_2 import chapter_2
from cps_agents.commands.reproduce.chapter_3 import chapter_3
from cps_agents.commands.reproduce.chapter_4 import chapter_4
from cps_agents.commands.reproduce.chapter_5 import chapter_5
from cps_agents.commands.reproduce.everything import everything
from cps_agents.commands.reproduce.testbed import section_2_5

app = typer.Typer(no_args_is_help=True)


@app.callback()
def reproduce() -> None:
    """Compute the tables, figures and claims of a chapter and put them beside what the paper prints."""


app.command("ch2")(chapter_2)
app.command("ch3")(chapter_3)
app.command("ch4")(chapter_4)
app.command("ch5")(chapter_5)
app.command("testbed")(section_2_5)
app.command("all")(everything)
