"""Pages and tables: results in, HTML and CSV out."""
