"""Models of warm machines: from temperatures and speeds, and what lags behind them, to a displacement."""
