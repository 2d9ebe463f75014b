"""The command line of benchmarks with several tables: computes those that are named, keeps the others."""

import argparse
import json
from collections.abc import Callable, Mapping
from pathlib import Path


def write_tables(description: str, tables: Mapping[str, Callable[[], object]], results: Path) -> None:
    """Compute the tables that the command line names, all without a name, and write each as soon as it is there."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"of {', '.join(tables)}; all without")
    chosen = parser.parse_args().tables or list(tables)
    results.parent.mkdir(exist_ok=True)
    found = json.loads(results.read_text()) if results.exists() else {}
    for name in chosen:
        print(name, flush=True)
        found[name] = tables[name]()
        results.write_text(json.dumps(found, indent=1))
