"""From parameters to what happens: the robot, the grip, the contact, the trajectory and the truth about slip.

Begin with `simulation.simulate`, then `contact` and `limit_surface` (why things slip), `truth` (what counts as slip).
`stepping` is the same physics step by step, with a grip force that follows commands; `inputs` are what changes then.
A new robot is a model in `robot` and a plan in `motion`; a new measure of slip is a field of `truth.Truth`.
"""
