"""Parts of networks: representations of events, and layers that work on coordinates. Apart from the networks,
because a change to any file of a folder compiles the folder's kernels anew."""
