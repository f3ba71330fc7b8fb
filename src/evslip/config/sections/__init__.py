"""The sections of a sample's parameters, one file each; `sample.SampleSpec` lists them.

A new parameter is a field with a docstring; a new section is a file here and a line in `SampleSpec`.
"""
