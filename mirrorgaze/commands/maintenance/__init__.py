"""Look after the installation."""
