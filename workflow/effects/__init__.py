"""The effects of the program: what each adds, when it matters, where it lives, what it costs."""
