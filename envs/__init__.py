"""The walking model in MuJoCo, as Gymnasium environments."""
