"""Name the settings that a live walk refuses; no simulator is imported, so that `--help` need not wait for it."""

PUSH_SECONDS = 0.1
"""Length of each push [s]; chosen."""
LIVE_REFUSES = {
    "push_newton": "the button Push pushes",
    "push_seconds": f"the button Push pushes for {PUSH_SECONDS:g} s",
    "push_interval": "the button Push pushes",
    "episode_seconds": "the walk has no end",
    "height_range": "the slider height sets it",
    "mass_range": "the slider mass sets it",
    "drawn_bodies": "its proportions stay",
    "drawn_feet": "menus and sliders set the feet",
    "speed_range": "the slider speed sets it",
    "speed_interval": "the slider speed sets it",
    "slope_range_deg": "the slider slope sets it",
}
"""Setting that a live walk does not take -> reason."""
