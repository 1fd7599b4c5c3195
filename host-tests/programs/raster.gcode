; A raster of 60 mm lines 5 mm apart: many square corners, short steps between them.
G21 G90 G17 G94
G0 X220 Y-30
G1 F9600 X280
Y-25
X220
Y-20
X280
Y-15
X220
Y-10
X280
Y-5
X220
Y0
X280
M2
