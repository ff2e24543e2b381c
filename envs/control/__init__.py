"""The control of the body: stiffness of ankles and toes, rest angles, hips and knees, standing."""
