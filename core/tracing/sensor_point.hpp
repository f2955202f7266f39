/// Where irradiance is asked for.
#pragma once

#include "core/base/types.hpp"

namespace lichthof {

struct SensorPoint {
  Vec3 point, normal;  ///< world (m); the normal need not be unit; light is counted on the side it points to
};

}  // namespace lichthof
