; One hop of 700 mm from place to place.
G21 G90
G0 X-350 Y400 Z-100
M103 X350
M2
