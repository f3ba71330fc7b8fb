"""A hand that holds an object, live in the browser. Begin with `world.World`."""
