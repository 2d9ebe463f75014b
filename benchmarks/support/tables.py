"""The command line of benchmarks with several tables: computes those that are named, keeps the others."""

import argparse
from collections.abc import Callable, Mapping

from benchmarks.support import results


def write_tables(description: str, tables: Mapping[str, Callable[[], object]], benchmark: str) -> None:
    """Compute the tables that the command line names (all without a name), and store each when it is complete."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"of {', '.join(tables)}; all without")
    chosen = parser.parse_args().tables or list(tables)
    figures = results.read_figures(benchmark)
    for name in chosen:
        print(name, flush=True)
        figures[name] = tables[name]()
        results.write_figures(benchmark, figures)
