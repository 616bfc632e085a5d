"""Whether a mount can be made, fitted and moved: checks on solids and their meshes, each with its figure and place."""
