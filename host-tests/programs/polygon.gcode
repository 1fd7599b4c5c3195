; The polygon of [Li23] Table 3, its translation: each corner with its own tolerance.
G21 G90
G0 X468 Y-100 Z0
G1 X468 Y0 F9000
G64 P4.2
X368 Y0
G64 P3.4
X350 Y100
G64 P2.6
X268 Y0
G61
X268 Y-100
G64 P4
X468 Y-100
M2
