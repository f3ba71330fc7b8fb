"""Everything to look at: pictures, videos, the report, the page of an evaluation, the explorer.

Begin with `report.report` (a page of sections) or `pictures.figures` (charts).
A new section of the report is a file in `report/sections` and one line in `report.report`.
"""
