"""Many dives instead of one: over seeds and parameters, in processes, with intervals instead of single numbers."""
