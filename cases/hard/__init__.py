"""Hard cases: data files of scenes that break comparable solvers, collected and checked by pytest."""
