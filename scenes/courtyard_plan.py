"""Dimensions of the courtyard in metres, and what it is made of."""

import furniture
import rooms
from model import Material

BAY = 3.0                # between two columns
BAYS_X, BAYS_Y = 5, 10   # bays across and along the court
STOREYS = 5
STOREY = 3.6             # floor to floor
SLAB = 0.3               # floor slab
CLEAR = STOREY - SLAB    # floor to ceiling
HALF_X, HALF_Y = BAYS_X * BAY / 2, BAYS_Y * BAY / 2
GALLERY = 2.0            # court's edge to the rooms' front
FRONT = 0.25             # thickness of the rooms' front
BACK = GALLERY + 5.6     # the outer wall's inside
PARTITION = 0.1          # half a partition wall
BEAM = (0.3, 0.5)        # ring beam under a gallery's edge: width, height of its court face
EAVES = STOREYS * STOREY + 0.7
RIDGE = EAVES + 3.4


def materials():
    colours = {
        "plaster": Material((0.68, 0.5, 0.28)),      # ochre, as the yards of the period
        "fascia": Material((0.74, 0.7, 0.61)),       # ring beams light: they draw the storeys' lines
        "brick": Material((0.5, 0.24, 0.15)),        # the ground storey's front
        "column": Material((0.72, 0.67, 0.57)),
        "gallery": Material((0.42, 0.38, 0.33)),     # terrazzo
        "paving": Material((0.56, 0.52, 0.45)),
        "paving_light": Material((0.68, 0.65, 0.58)),
        "paving_dark": Material((0.17, 0.16, 0.16)),
        "rail": Material((0.11, 0.17, 0.16)),        # dark green iron
        "iron": Material((0.2, 0.22, 0.23)),         # roof
        "tread": Material((0.5, 0.36, 0.21)),
        "clock": Material((0.82, 0.8, 0.74)),
        "water": Material((0.06, 0.09, 0.1)),
        # Radiances chosen for about 80 lx on the court's floor and 700 lx on a lit room's desks (179 lm/W).
        "lamp_pendant": Material((0, 0, 0), ke=(34, 25, 15)),
        "lamp_up": Material((0, 0, 0), ke=(58, 44, 27)),
        "lamp_room": Material((0, 0, 0), ke=(38, 37, 33)),
        "lamp_gate": Material((0, 0, 0), ke=(60, 42, 24)),
    }
    return colours | rooms.materials() | furniture.materials()
