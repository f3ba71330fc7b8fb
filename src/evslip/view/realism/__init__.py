"""How near simulated events are to real ones: a table, and a page with pictures. Begin with `page.write_realism`."""
