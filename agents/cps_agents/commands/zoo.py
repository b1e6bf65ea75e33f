"""`cps-envs zoo`: trained policies, shipped and your own."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cps_agents.console import err, out, print_json
from cps_agents.table import Table

if TYPE_CHECKING:
    from cps_agents.zoo.card import Card

app = typer.Typer(no_args_is_help=True, help="Look up trained policies, shipped and your own, or add one.")
JSON = Annotated[bool, typer.Option("--json", help="Machine-readable output.")]


@app.command("list")
def list_policies(
    folder: Annotated[Path | None, typer.Option(help="Of policies of your own; the shipped ones if left out.")] = None,
    as_json: JSON = False,
) -> None:
    """The policies in a folder, by default those that come with the package."""
    from cps_agents.zoo.card import SHIPPED, read_card
    from cps_agents.zoo.files import shipped_names

    home = folder or SHIPPED
    cards = [read_card(home / f"{name}.json") for name in shipped_names(home)]
    if as_json:
        print_json([card.to_json() for card in cards])
        return
    rows = [(card.name, card.problem, card.role, card.algorithm, card.opponent, str(len(card.seeds))) for card in cards]
    columns = ("zoo:", "problem", "role", "algorithm", "trained against", "seeds")
    out().print(Table("Trained policies", columns, rows, left=5))


@app.command()
def show(
    name: Annotated[str, typer.Argument(help="A shipped policy, a card's path, or the folder of a training run.")],
    as_json: JSON = False,
) -> None:
    """How a policy was trained, what it reached on validation seeds, and its numbers where it has names for them."""
    from cps_agents.zoo.card import read_card
    from cps_agents.zoo.files import find

    card = read_card(find(name))
    if as_json:
        print_json(card.to_json())
        return
    _print(card)
    if card.family:
        _print_numbers(card, find(name))


@app.command("card")
def print_card(
    name: Annotated[str, typer.Argument(help="A shipped policy, a card's path, or the folder of a training run.")],
    to: Annotated[Path | None, typer.Option("--out", metavar="FILE.md", help="Standard output if left out.")] = None,
) -> None:
    """A policy's card as Markdown, with the header that model hubs read."""
    from cps_agents.files import write_text
    from cps_agents.zoo.card import read_card
    from cps_agents.zoo.files import find
    from cps_agents.zoo.markdown import to_markdown

    text = to_markdown(read_card(find(name)))
    if to is None:
        typer.echo(text, nl=False)
        return
    write_text(to, text)
    err().print(f"Written: {to}", soft_wrap=True)


@app.command()
def add(
    runs: Annotated[list[Path], typer.Argument(help="Folders of training runs, or the folder of a recipe's runs.")],
    folder: Annotated[Path, typer.Option("--to", help="Where NAME.safetensors and NAME.json go.")] = Path("zoo"),
    name: Annotated[str | None, typer.Option(help="Of the policy; the recipe's if left out.")] = None,
    as_json: JSON = False,
) -> None:
    """Put the best networks of several training seeds into one policy, which plays as zoo:FOLDER/NAME.json."""
    from cps_agents.zoo.card import read_card
    from cps_agents.zoo.merging import cards_below, merge

    cards = [card for run in runs for card in cards_below(run)]
    target = folder / f"{name or read_card(cards[0]).name}.json"
    merged = merge(cards, target)
    if as_json:
        print_json(merged.to_json())
        return
    _print(merged)
    err().print(f"Written: {target} and {target.with_suffix('.safetensors')}. It plays as zoo:{target}", soft_wrap=True)


def _print(card: Card) -> None:
    console = out()
    console.print(f"[bold]{card.name}[/]: {card.role} of {card.problem}-v{card.version} by {card.algorithm}")
    console.print(f"trained against {card.opponent}, preset {card.preset} with {dict(card.overrides)}", soft_wrap=True)
    console.print(f"command: {card.command}", soft_wrap=True)
    rows = [
        (
            f"{seed}{' (plays)' if int(seed) == card.best else ''}",
            *(f"{facts[key]:.4g}" if key in facts else "" for key in ("steps", "cpu_s", "validation")),
        )
        for seed, facts in card.seeds.items()
    ]
    console.print(Table("", ("training seed", "steps", "CPU s", "validation"), rows))


def _print_numbers(card: Card, path: Path) -> None:
    """The numbers of a policy that is one of a family, by training seed."""
    from cps_agents.zoo.files import load

    columns = [load(path, int(seed))[1].tensors()["numbers"] for seed in card.seeds]
    rows = [(name, *(f"{column[k]:.4g}" for column in columns)) for k, name in enumerate(card.numbers)]
    title = f"Numbers of the family {card.family}, by training seed"
    out().print(Table(title, ("number", *card.seeds), rows))
