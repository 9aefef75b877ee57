"""Box and PC on a live bus: the state machines of the simulation, driven by the real clock.

The modules are imported one by one: the process that shows the view needs no compiled code.
"""
