"""`infthor-eval doctor`: what there is on this machine, and what to do where something is missing."""

import click

__all__ = ["command"]

_STYLES = {"ok": "green", "optional": "yellow", "wrong": "red"}


@click.command("doctor")
@click.option("--json", "as_json", is_flag=True, help="Write what was found as JSON.")
def command(as_json: bool) -> int:
    """Look at what evaluations need: Python, torch, simulators, the hub, disk, data; each with its mend.

    Ends with 1 where something is missing that nothing will do without.
    """
    import msgspec
    from rich.text import Text

    from infthor_eval.cli.checks import checks
    from infthor_eval.terminal import console, print_line, printable

    found = []
    on = console()
    for check in checks():
        found.append(check)
        if not as_json:
            on.print(
                Text.assemble((f"{check.state:9}", _STYLES[check.state]), printable(f"{check.name}: {check.found}"))
            )
            if check.mend:
                print_line(f"{'':9}{check.mend}")
    if as_json:
        click.echo(msgspec.json.format(msgspec.json.encode(found), indent=2))
    return int(any(check.state == "wrong" for check in found))
