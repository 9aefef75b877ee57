"""How an axis is measured and judged: instrument files, measuring programs, ISO 230-2."""
