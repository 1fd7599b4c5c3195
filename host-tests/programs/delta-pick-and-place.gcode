; The pick and place of [vNoorden21] for the robot delta-800.toml, there and back:
; 50 mm up, 700 mm across, 50 mm down, at 1 m/s.
G21 G90 G17 G94
G0 X-350 Y0 Z-767
G1 F60000 Z-717
X350
Z-767
Z-717
X-350
Z-767
M2
