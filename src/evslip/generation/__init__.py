"""From an index to a record, and from a configuration to a data set, on one machine or a cluster.

Begin with `generate.make_record`, then `generate.generate`.
A new way to run jobs is a file in `runners` and a line in its register.
"""
