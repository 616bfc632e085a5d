"""Attacks on what people and machines give us: damaged files, kills at any moment, a full disk."""
