; Up, across, down, and back: 40 mm up, 200 mm across.
G21 G90 G17 G94
G0 X220 Y-100 Z0
G1 F18000 Z40
Y100
Z0
Z40
Y-100
Z0
M2
