"""One function for each command, in rooms by the headings of `mirrorgaze --help`."""
