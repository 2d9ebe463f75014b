"""Hard cases: what breaks solvers like these, as files of data that pytest collects and tries within bounds."""
