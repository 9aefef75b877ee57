"""From readings to curves: tables with a spacing that pays, networks and the four algorithms that train them."""
