"""Plans of trials and what they show: the evidence."""
