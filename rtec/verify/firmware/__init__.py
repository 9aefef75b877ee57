"""Machine code as an insertion algorithm, and its whole contract on the board."""
