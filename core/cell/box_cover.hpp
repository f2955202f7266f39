/// When a cell may be spared a visit: what a hemicube bitmap must cover so that a box counts as hidden.
///
/// HemicubeBitmap::covers asks for more: that not even the 2x2 filter, reading one pixel beyond the outline of the box, may
/// let anything through. A wall that fills the whole side between two cells ends where the box ends; the pixels just outside
/// are free, and nothing would ever be spared. Here the pixels of the box itself decide, as the paper's bits do.
#pragma once

#include "core/light/hemicube_bitmap.hpp"

namespace lichthof {

/// True when every pixel whose centre ray meets the box in front of the base plane is covered. A box too small to hold a
/// pixel centre is judged by HemicubeBitmap::covers; one that holds or touches the centre is never hidden.
/// @cost  0.1 µs when a probe finds a free pixel, else the scan-line fill of up to three sides: about 10 µs at R = 128
bool hides(const HemicubeBitmap& bitmap, const HemicubeFrame& frame, const Box& box);

}  // namespace lichthof
