"""Heat: a network of nodes that speeds and surroundings warm, what grows by it, and what thermometers say of it."""
