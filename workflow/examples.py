"""Examples of each command for its help text and the documentation; a test parses each with the real parser."""

EXAMPLES = {
    "new": ("reflowshock new mine", "reflowshock new mine --template sessile_drop"),
    "init": (
        "reflowshock init",
        'reflowshock init --name mine --array "6 x 6 at 0.8 mm" --ball usual --board "132 x 77 x 1 mm" --drop B',
    ),
    "import": (
        "reflowshock import board.kicad_pcb",
        "reflowshock import board.kicad_pcb --component U8 --name mine",
        'reflowshock import gerbers --component U8 --thickness "1.6 mm" --ball "0.5 mm"',
    ),
    "schema": ("reflowshock schema > reflowshock.schema.json",),
    "plan": ("reflowshock plan mine.toml", 'reflowshock plan mine.toml --set "package.pitch=0.8 mm"'),
    "effects": ("reflowshock effects", "reflowshock effects mine.toml"),
    "run": (
        "reflowshock run mine.toml",
        'reflowshock run mine.toml --set "shock.peak_acceleration=1000 G" --out runs/softer',
        "reflowshock run mine.toml --until solder_mesh -j 2",
    ),
    "status": ("reflowshock status mine.toml", "reflowshock status mine.toml --follow"),
    "verify": ("reflowshock verify mine.toml",),
    "report": ("reflowshock report mine.toml --open", "reflowshock report mine.toml --movie drop.gif"),
    "compare": ("reflowshock compare runs/mine runs/softer --out compared.html",),
    "clean": ("reflowshock clean mine.toml", "reflowshock clean mine.toml --unused"),
    "study": ("reflowshock study study.toml --dry-run", "reflowshock study study.toml -j 2"),
    "accuracy": (
        "reflowshock accuracy mine.toml --tolerance 5%",
        "reflowshock accuracy mine.toml --budget 10min --set scale=quick",
    ),
    "stress-test": ("reflowshock stress-test --family coupling --random 20 --seed 3",),
}


def examples(command: str) -> str | None:
    """Return the examples at the end of a command's help text, one paragraph each; None without examples.

    Args:
        command: Name of the command, such as "run".
    """
    return "\n\n".join(("Examples:", *EXAMPLES[command])) if command in EXAMPLES else None
