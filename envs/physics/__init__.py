"""The body in MuJoCo: model, feet, contacts, simulation, measurement, energy and pictures."""
