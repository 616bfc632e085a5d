"""Formats that training code reads, made of a data set's samples; none of them needs a library of its own to write."""
