"""Dives as ROS 2 bags, written without ROS: what a robot would have recorded, and the truth beside it."""

from tracking.bags.bag import write_bag

__all__ = ["write_bag"]
