"""What to change so that a blind patch is seen, found by tracing it again."""
