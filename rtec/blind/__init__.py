"""The hidden-effect game: an emulated axis with something hidden in it, measured for others to find."""
