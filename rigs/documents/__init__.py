"""Files as documents: validated against a specification, with every problem at once in the words of the file."""
