"""Many walks held against each other; each runs as `springfoot study NAME`."""
