"""Hard trials of elements and of coupled models: small bodies in memory, and what must hold of them."""
