; Corner path after Fig. 11 of [Yeh26]: an arc and four lines, 458.58 mm.
; Change angles at its corners: 66.038, 47.925, 158.963 and 90.000 degrees.
; Millimetres, feedrate in mm/min (9600 = 160 mm/s). It sets no corner
; tolerance: the robot's or the command line's holds.
G21 G90 G17
G0 X180 Y0 Z0
G3 X225 Y-45 I45 J0 F9600
G1 X265 Y45
X225 Y135
X315 Y45
X270 Y0
M2
