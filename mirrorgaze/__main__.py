"""`python -m mirrorgaze`, and the installed `mirrorgaze`."""

from mirrorgaze.interrupts import exit_on_interrupt


def main() -> None:
    """Run the command line; Ctrl-C is listened to before the imports, which take a moment."""
    exit_on_interrupt()
    from mirrorgaze.cli import main as run

    run()


if __name__ == "__main__":
    main()
