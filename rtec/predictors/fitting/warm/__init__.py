"""Fits of what stands behind the features of a warm machine; all are judged by leaving out whole blocks."""
