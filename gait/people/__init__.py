"""How people walk: curves by walking speed or from files of your own, their strides, and scores against them."""
