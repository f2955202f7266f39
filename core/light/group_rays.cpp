#include "core/light/group_rays.hpp"

#include "core/base/random.hpp"
#include "core/scene/polygon.hpp"

namespace lichthof {

namespace {

static_assert(GroupRays::count % 16 == 0, "whole packets");

/// Strata in random order, so that a ray's direction says nothing about its place.
std::array<std::uint32_t, GroupRays::count> shuffled_strata(Random& random) {
  std::array<std::uint32_t, GroupRays::count> order{};
  for (std::uint32_t k = 0; k < GroupRays::count; ++k) {
    const std::uint32_t place = random.below(k + 1);
    order[k] = order[place];
    order[place] = k;
  }
  return order;
}

}  // namespace

void cast_from_group(const Mesh& mesh, std::uint32_t index, std::uint32_t batch, const RayScene& rays, GroupRays& out) {
  const Group& group = mesh.groups[index];
  const Plane& plane = mesh.planes[group.plane.value];
  const std::span<const Vec2> corners = mesh.polygon(group.polygon);
  Random random(std::uint64_t{batch} << 32 | index);
  const Vec2 shift{random.unit(), random.unit()};
  const std::array<std::uint32_t, GroupRays::count> order = shuffled_strata(random);
  Segments16 segments;
  clear_segments(segments);
  RayScene::Hits16 hits;
  for (std::uint32_t first = 0; first < GroupRays::count; first += 16) {
    for (std::uint32_t lane = 0; lane < 16; ++lane) {
      const std::uint32_t ray = first + lane, stratum = order[ray];
      const Vec2 square{(stratum % GroupRays::strata + random.unit()) / GroupRays::strata,
                        (stratum / GroupRays::strata + random.unit()) / GroupRays::strata};
      const Vec3 local = cosine_direction(square);
      out.direction[ray] = local.x * plane.u + local.y * plane.v + local.z * plane.normal;
      out.from[ray] = plane.point(place_in(corners, group.area, r2_point(ray, shift))) + rays.offset() * plane.normal;
      const Vec3 start = out.from[ray] - rays.origin(), &direction = out.direction[ray];
      segments.ox[lane] = static_cast<float>(start.x), segments.dx[lane] = static_cast<float>(direction.x);
      segments.oy[lane] = static_cast<float>(start.y), segments.dy[lane] = static_cast<float>(direction.y);
      segments.oz[lane] = static_cast<float>(start.z), segments.dz[lane] = static_cast<float>(direction.z);
    }
    rays.nearest16(segments, 0xffff, hits);
    for (std::uint32_t lane = 0; lane < 16; ++lane) {
      out.surface[first + lane] = hits.surface[lane];
      out.distance[first + lane] = hits.distance[lane];
      out.front[first + lane] = (hits.front_bits >> lane & 1) != 0;
    }
  }
}

}  // namespace lichthof
