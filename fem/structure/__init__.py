"""One structure: a box of layers under supports and loads."""
