"""``python -m workflow`` in a checkout is the command ``reflowshock``."""

from reflowshock.__main__ import main

if __name__ == "__main__":
    main()
