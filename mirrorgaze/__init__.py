"""The command line: it parses, calls and writes; the logic lives in the other packages."""
