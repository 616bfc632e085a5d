"""`python -m mirrorgaze`."""

from mirrorgaze.cli import main

main()
