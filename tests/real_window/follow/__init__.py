"""How long a stroke takes until baked textures show it."""
