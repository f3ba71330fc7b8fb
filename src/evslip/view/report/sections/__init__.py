"""The sections of a report, one a module: each gives its HTML, or "" where there is nothing to show."""
