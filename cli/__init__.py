"""The commands of `springfoot`: train, evaluate, live, export, study. `train.py` and `evaluate.py` open two."""
