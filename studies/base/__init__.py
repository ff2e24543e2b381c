"""The parts of every study: flags, progress, files, intervals."""
