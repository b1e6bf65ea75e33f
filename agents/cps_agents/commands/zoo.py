"""`cps-envs zoo`: trained policies, shipped and your own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cps_agents.commands.options import AsJson
from cps_agents.console import note, out, print_json
from cps_agents.files import write_text
from cps_agents.sheet import Sheet
from cps_agents.zoo.card import SHIPPED, Card, read_card
from cps_agents.zoo.files import find, shipped_names
from cps_agents.zoo.markdown import to_markdown
from cps_agents.zoo.merging import cards_below, merge
from cps_agents.zoo.references import reference_to
from cps_envs.core.errors import require

app = typer.Typer(no_args_is_help=True, help="Look up trained policies, shipped and your own, or add one.")


@app.command("list")
def list_policies(
    folder: Annotated[Path | None, typer.Option(help="Folder of your own policies; default: the shipped ones.")] = None,
    as_json: AsJson = False,
) -> None:
    """List the policies in a folder; default: those of the package."""
    cards = _cards(folder or SHIPPED)
    if as_json:
        print_json([card.to_json() for card in cards])
        return
    rows = [(card.name, card.problem, card.role, card.algorithm, card.opponent, str(len(card.seeds))) for card in cards]
    columns = ("zoo:", "problem", "role", "algorithm", "trained against", "seeds")
    out().print(Sheet("Trained policies", columns, rows, left=5))


@app.command()
def show(
    name: Annotated[str, typer.Argument(help="Shipped policy, path of a card, or folder of a training run.")],
    as_json: AsJson = False,
) -> None:
    """Show how a policy was trained, and what it reached on validation seeds."""
    card = read_card(find(name))
    if as_json:
        print_json(card.to_json())
        return
    _print(card)


@app.command("card")
def print_card(
    name: Annotated[str, typer.Argument(help="Shipped policy, path of a card, or folder of a training run.")],
    to: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.md", help="Write to this file; default: stdout.")
    ] = None,
) -> None:
    """Print a policy's card as Markdown, with the header that model hubs read."""
    text = to_markdown(read_card(find(name)))
    if to is None:
        typer.echo(text, nl=False)
        return
    write_text(to, text)
    note(f"Written: {to}")


@app.command()
def add(
    runs: Annotated[list[Path], typer.Argument(help="Folders of training runs, or the folder of a recipe's runs.")],
    folder: Annotated[Path, typer.Option("--to", help="Write NAME.safetensors and NAME.json to this folder.")] = Path(
        "zoo"
    ),
    name: Annotated[str | None, typer.Option(help="Name of the policy; default: the recipe's.")] = None,
    as_json: AsJson = False,
) -> None:
    """Combine the best networks of several training seeds into one policy, zoo:FOLDER/NAME.json."""
    cards = [card for run in runs for card in cards_below(run)]
    target = folder / f"{name or read_card(cards[0]).name}.json"
    merged = merge(cards, target)
    if as_json:
        print_json(merged.to_json())
        return
    _print(merged)
    note(f"Written: {target} and {target.with_suffix('.safetensors')}. It plays as zoo:{target}")


@app.command("import")
def import_model(
    model: Annotated[str, typer.Argument(help="sb3:model.zip, or sb3:FOLDER with seed-0/model.zip, ...")],
    folder: Annotated[
        Path, typer.Option("--to", help="Write policy.json and policy.safetensors to this folder.")
    ] = Path("policy"),
    role: Annotated[
        str | None, typer.Option(help="Such as FdiAttack, of a model without the learning interface.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Turn a model of stable-baselines3 into weights and a card, which run no code."""
    require("stable_baselines3", extra="sb3", purpose="importing a model of stable-baselines3")
    from cps_agents.zoo.importing import import_models

    target = folder / "policy.json"
    card = import_models(model, target, role)
    if as_json:
        print_json(card.to_json())
        return
    _print(card)
    note(f"Written: {target} and {target.with_suffix('.safetensors')}. It plays as {reference_to(folder)}")


def _cards(folder: Path) -> list[Card]:
    """The cards of a folder, by name."""
    return [read_card(folder / f"{name}.json") for name in shipped_names(folder)]


def _print(card: Card) -> None:
    console = out()
    console.print(card.name, style="bold", end="", markup=False)
    told = (
        f": {card.role} of {card.problem}-v{card.version} by {card.algorithm}",
        f"trained against {card.opponent}, preset {card.preset} with {dict(card.overrides)}",
        f"command: {card.command}",
    )
    for line in told:
        console.print(line, markup=False, soft_wrap=True)
    rows = [
        (
            f"{seed}{' (plays)' if int(seed) == card.best else ''}",
            *(f"{facts[key]:.4g}" if key in facts else "" for key in ("steps", "cpu_s", "validation")),
        )
        for seed, facts in card.seeds.items()
    ]
    console.print(Sheet("", ("training seed", "steps", "CPU s", "validation"), rows))
