"""Dives as ROS 2 bags, written without ROS: what a robot would have recorded, and the truth beside it."""

from dives.bags.bag import write_bag
from dives.bags.recording import dive_rig

__all__ = ["dive_rig", "write_bag"]
