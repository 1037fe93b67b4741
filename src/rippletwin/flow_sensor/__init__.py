"""Virtual flow sensors: the flow at the pump outlet from the pressure along the line."""
