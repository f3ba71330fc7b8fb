"""Local pages for looking at samples and recordings, and for labelling them by hand."""
