"""G-code programs whose axis words are corrected by a predictor, for machines without a corrector."""
