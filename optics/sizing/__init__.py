"""The smallest mirrors for a window of the image and a range of gazes."""
