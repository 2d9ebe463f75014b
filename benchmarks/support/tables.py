"""Command line of benchmarks with several tables: compute the selected tables and keep the others."""

import argparse
from collections.abc import Callable, Mapping

from benchmarks.support import results


def write_tables(description: str, tables: Mapping[str, Callable[[], object]], benchmark: str) -> None:
    """Compute the tables named on the command line (default: all) and store each when it is complete.

    Args:
        description: Description of the benchmark for its help.
        tables: Name of a table -> function that computes it.
        benchmark: Name of the benchmark's results; its other tables are kept.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"tables among {', '.join(tables)} (default: all)")
    chosen = parser.parse_args().tables or list(tables)
    figures = results.read_figures(benchmark)
    for name in chosen:
        print(name, flush=True)
        figures[name] = tables[name]()
        results.write_figures(benchmark, figures)
