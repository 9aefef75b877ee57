"""Box and PC on a live bus: the machines of simulated time, moved by a clock that nobody can stop.

The modules are imported one by one: the process that shows the view needs no compiled code.
"""
