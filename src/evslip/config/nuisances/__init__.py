"""Sections of the parameters that make a world misbehave: all of them do nothing by default."""
