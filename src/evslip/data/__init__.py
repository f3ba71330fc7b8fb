"""Records and data sets on disk: one file a sample, written once; what is there is known from the files alone.

Begin with `record` (a sample) and `record_file` (its file), then `samples` (any folder of records), of which `dataset`
(one that evslip made) and `recordings` are two kinds. `building` makes a data set.
A new part of a record is a field of `record.Record`, written and read in `record_file`, checked in `record_checks`.
"""
