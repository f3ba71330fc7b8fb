"""Ways on which events come and go, a file each: see SOURCES and TARGETS one folder up."""
