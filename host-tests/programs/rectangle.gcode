; Once around a rectangle of 80 by 60 mm.
G21 G90 G17 G94
G0 X200 Y-30
G1 F9600 X280
Y30
X200
Y-30
M2
