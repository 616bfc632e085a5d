"""Design mirrors, and study a design: size, coverage, tolerances, search."""
