"""A small ray tracer in numpy and the still life that it photographs."""
