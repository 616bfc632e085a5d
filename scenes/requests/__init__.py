"""Render requests and their results: what a user asks for, and the files it becomes."""
