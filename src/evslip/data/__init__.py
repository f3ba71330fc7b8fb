"""Records and data sets on disk: one file a sample, written once; what is there is known from the files alone.

Begin with `record` (a sample's file), then `samples` (any folder of records) and `dataset` (one that evslip made).
A new part of a record is a field of `record.Record`, written and read there.
"""
