"""The three clocks of a simulated walk, each a whole number of the one before it."""

PHYSICS_STEP = 0.002
"""Physics step [s], the same for every body: half the cost of 1 ms, and the same gait (docs/results/cost.md)."""
CONTROL_WINDOW = 0.01
"""Control window [s]: controls are held and forces averaged over it; chosen."""
ACTION_STEP = 0.02
"""Time between two actions [s] by default: stiffness is decided at 50 Hz; chosen. Reward weights and the discount of
training are given for this time, whatever a step lasts (`BipedSettings.step_seconds`)."""
WINDOWS_PER_ACTION_STEP = round(ACTION_STEP / CONTROL_WINDOW)
"""Control windows in one step of the default 20 ms."""
PHYSICS_STEPS_PER_WINDOW = round(CONTROL_WINDOW / PHYSICS_STEP)
"""Physics steps in one control window."""
