"""Solids of a mirror gaze in millimetres: hull, fold bracket, gimbal, servos and mirrors, and what is made of them."""
