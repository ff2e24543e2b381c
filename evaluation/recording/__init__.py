"""The one loop over a walk: a policy's episodes as 100 Hz series."""
