"""The processor: decoded program memory, the compiled loop, and the face that owns its state."""
