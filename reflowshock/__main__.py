"""Entry point of ``python -m reflowshock``; errors during start-up are reported in one line, too."""

from reflowshock.workflow.process.error_exit import handle_signals, one_line_errors


def main() -> None:
    """Run the command line of the program with the arguments of the process; it prepares threads and caches first."""
    with one_line_errors():
        handle_signals()
        from reflowshock.workflow.process.environment import prepare, restart_in_utf8

        restart_in_utf8()
        prepare()  # before any library is loaded
        from reflowshock.workflow.cli import main as run_command_line

        run_command_line()


if __name__ == "__main__":
    main()
