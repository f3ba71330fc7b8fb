"""To and from others: recordings and other simulators in, frames into events, formats into formats, publications.

Begin with `importing` (foreign data into records), `frames_to_events`, `format_to_format` or `publishing` (records for
others).
A new target is a module of its own, called by one verb in `evslip.cli`.
"""
