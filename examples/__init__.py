"""Programs to start from; `springfoot examples --copy FOLDER` copies them."""
