"""Training, evaluation and reports: everything that needs a learner."""
