"""Bags of ROS."""
