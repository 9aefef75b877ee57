"""Results as a page, figures and tables; nothing is computed here."""
