"""Robots: an arm, or none, and the gripper that it carries, each described in one place.

Begin with `description`; `arms` and `grippers` hold those that are built in, `catalogue` finds them by name, and
`model` makes MuJoCo's bodies and servos of them.
"""
