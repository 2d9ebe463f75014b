"""``python -m workflow`` is the command ``reflowshock``."""

from workflow.cli import main

if __name__ == "__main__":
    main()
