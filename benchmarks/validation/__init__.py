"""Every claim of the manual run again, and the page that says how it went."""
