"""The robot's side: it finds the target in the gaze mirror's image and turns the mirror after it.

It runs on a robot's computer, without anything that renders or models solids.
"""
