"""The report: one HTML page on a data set, a model or an evaluation. Begin with `report.write_report`."""
