"""A measurement and its model: compared, diagnosed, and made better effect by effect."""
