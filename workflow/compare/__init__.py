"""The command ``compare``: runs side by side, what differs in their parameters and in their answers."""
