; The pick and place of [vNoorden21] as one hop, for the robot delta-800-payload.toml.
G21 G90
G0 X-350 Y0 Z-767
M103 X350
M2
