"""The cases of the program: a folder each, and the hard ones."""
