"""A positioning test as metrologists know it: the plot of ISO 230-2, its tables, a page and a PDF."""
