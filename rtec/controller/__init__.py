"""The machine-tool controller's input: digital filter, quadrature decoder, fault policy, latches."""
