"""Step levels inside one model: local time steps of elements that need small ones."""
