; nothing moves
G21 G90
M2
