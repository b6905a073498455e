"""``er-il doctor``: what the machine lacks."""

WHOLE_LINES = 200  # columns of output that is piped, so that each check is one line there


def doctor() -> None:
    """Say what this machine lacks and how to get it; the exit code is 1 if `er-il demo` cannot run."""
    import sys
    from pathlib import Path

    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from er_il.support.machine import examine

    console = Console(width=None if sys.stdout.isatty() else WHOLE_LINES)
    with console.status("Looking at the machine"):
        checks = examine(Path.cwd())
    table = Table(box=None, header_style="bold")
    for heading in ("", "Check", "Here", "How to get it"):
        table.add_column(heading, overflow="fold")
    for check in checks:
        verdict = "[green]ok" if check.present else "[red]missing" if check.needed else "[yellow]optional"
        table.add_row(verdict, check.name, escape(check.found), "" if check.present else escape(check.remedy))
    console.print(table)
    missing = [check.name for check in checks if check.needed and not check.present]
    console.print(f"er-il demo cannot run: {', '.join(missing)}." if missing else "er-il demo can run.")
    if missing:
        sys.exit(1)
