"""``python -m workflow`` is the command ``reflowshock``; what happens while the program loads is told, too."""

from workflow.process.last_word import heed_signals, last_word


def main() -> None:
    """Prepare the process, then load and run the command line."""
    with last_word():
        heed_signals()
        from workflow.process.environment import begin_again_in_utf8, prepare

        begin_again_in_utf8()
        prepare()  # before any library is loaded
        from workflow.cli import main as run_command_line

        run_command_line()


if __name__ == "__main__":
    main()
