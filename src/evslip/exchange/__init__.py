"""To and from others: recordings and other simulators in, frames into events, formats into formats, publications.

Begin with `importing` (foreign data into records) or `publishing` (records for others).
A new target is a module of its own, called by one verb in `evslip.cli`.
"""
