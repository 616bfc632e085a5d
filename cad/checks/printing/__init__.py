"""Whether the parts print: walls, orientation on the plate, a slicer's verdict."""
