"""What box and PC send each other, and how long it takes."""
