"""Data of others into records: files of events, folders of other simulators. Begin with `recordings`."""
