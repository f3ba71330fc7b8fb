"""Inputs of the simulation that change with time: the grip force, and what disturbs the grasp.

`actuator` makes a force of commands, `disturbance` says what happens when, `carried_object` does it to the model. A new
disturbance is a name in `config.nuisances.disturbance` and a column of `disturbance.Conditions`.
"""
