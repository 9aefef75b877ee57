"""What the box does under every fault in every phase, and over a long life."""
