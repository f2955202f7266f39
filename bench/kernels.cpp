#include <algorithm>
#include <cmath>

#include "bench/measure.hpp"
#include "bench/packets.hpp"
#include "bench/sections.hpp"
#include "core/base/random.hpp"
#include "core/light/bit_projector.hpp"
#include "core/light/form_factor.hpp"

namespace lichthof::bench {

namespace {

constexpr std::size_t pair_count = 512;  // clusters of 16: some 200 KB, what a shot touches between two others
constexpr std::uint32_t resolution = 128;
constexpr std::size_t frame_count = 16, packet_count = 256;

/// A cluster of 16 receivers and the patch it sees, for the kernels and for the scalar form factor.
struct Pair {
  Receivers16 receivers;
  FlatShooter flat;
  Aim16 aim;
  std::vector<Vec3> corners;  ///< of the patch, local
  std::vector<Vec3> points, normals;
};

Pair pair_of(const Mesh& mesh, const Cluster& cluster, const Patch& patch, const Vec3& origin) {
  Pair pair;
  pair.receivers = cluster.points;
  const Plane& plane = mesh.planes[patch.plane.value];
  for (const Vec2& corner : mesh.polygon(patch.polygon)) pair.corners.push_back(plane.point(corner) - origin);
  pair.flat = flat_shooter(pair.corners, plane.normal, Vec3{0.0});
  std::fill_n(pair.aim.x, 32, pair.flat.cx), std::fill_n(pair.aim.y, 32, pair.flat.cy);
  std::fill_n(pair.aim.z, 32, pair.flat.cz);
  const Receivers16& r = cluster.points;
  for (int lane = 0; lane < 16; ++lane) {
    pair.points.emplace_back(r.x[lane], r.y[lane], r.z[lane]);
    pair.normals.emplace_back(r.nx[lane], r.ny[lane], r.nz[lane]);
  }
  return pair;
}

/// Pairs of the scene where all 16 receivers see the patch, occluders left aside, horizons cutting it or not.
std::vector<Pair> pairs_of(const BenchCase& scene, const PacketScene& packets) {
  std::vector<Pair> pairs;
  const Mesh& mesh = *scene.mesh();
  Random random(11);
  Factors16 factors;
  clear_segments(factors.segments);
  for (std::size_t tries = 0; pairs.size() < pair_count && tries < 1000 * pair_count; ++tries) {
    const Cluster& cluster =
        packets.tree.clusters[random.below(static_cast<std::uint32_t>(packets.tree.clusters.size()))];
    const Patch& patch = mesh.patches[random.below(static_cast<std::uint32_t>(mesh.patches.size()))];
    if (cluster.lanes != 0xffff || patch.polygon.count > static_cast<std::uint32_t>(FlatShooter::max_corners)) continue;
    const Pair pair = pair_of(mesh, cluster, patch, packets.origin);
    if (kernels().factor16(pair.receivers, 0xffff, pair.flat, pair.aim, 0, 1e-6f, factors) == 0xffff)
      pairs.push_back(pair);
  }
  return pairs;
}

void add_form_factors(const BenchCase& scene, const PacketScene& packets, Section& section) {
  const std::vector<Pair> pairs = pairs_of(scene, packets);
  if (pairs.empty()) return;
  Factors16 factors;
  clear_segments(factors.segments);
  std::vector<std::function<void()>> works{[&] {
    double sum = 0;
    for (const Pair& pair : pairs)
      for (std::size_t lane = 0; lane < 16; ++lane)
        sum += form_factor(pair.points[lane], pair.normals[lane], pair.corners);
    keep(sum);
  }};
  for (const Kernels& width : available_kernels())
    works.emplace_back([&, kernel = width.factor16] {
      float sum = 0;
      for (const Pair& pair : pairs) {
        kernel(pair.receivers, 0xffff, pair.flat, pair.aim, 0, 1e-6f, factors);
        sum += factors.factor[0];
      }
      keep(sum);
    });
  const std::vector<double> seconds = cpu_s_per_call(works, scene.repeat());
  const double count = 16.0 * static_cast<double>(pairs.size());
  section.add("scalar/pairs_per_s", "form factors, scalar, double precision", count / seconds[0], "1/s");
  for (std::size_t k = 0; k < available_kernels().size(); ++k) {
    const std::string name = available_kernels()[k].name;
    const bool widest = k + 1 == available_kernels().size();
    section.add(name + "/pairs_per_s", "form factors, " + name, count / seconds[k + 1], "1/s");
    section.add(name + "/ratio", "form factors, " + name + " : scalar", seconds[0] / seconds[k + 1], "",
                widest ? std::optional(at_least(15)) : std::nullopt);
  }
}

void add_bitmaps(const BenchCase& scene, Section& section) {
  const Mesh& mesh = *scene.mesh();
  std::vector<HemicubeFrame> frames;
  Random random(12);
  for (std::size_t k = 0; k < frame_count; ++k) {
    const Group& group = mesh.groups[random.below(static_cast<std::uint32_t>(mesh.groups.size()))];
    const Plane& plane = mesh.planes[group.plane.value];
    frames.push_back({group.centre, plane.u, plane.v, plane.normal});
  }
  std::vector<float> directions(packet_count * 48);
  for (std::size_t i = 0; i < directions.size(); i += 48)
    for (std::size_t lane = 0; lane < 16; ++lane) {
      const Vec3 d = cosine_direction({random.unit(), random.unit()});
      for (std::size_t axis = 0; axis < 3; ++axis)
        directions[i + 16 * axis + lane] = static_cast<float>(d[static_cast<int>(axis)]);
    }
  HemicubeBitmap bitmap(resolution);
  const auto fill = [&] {
    for (const HemicubeFrame& frame : frames) {
      bitmap = HemicubeBitmap(resolution);
      for (const Surface& surface : scene.scene()->surfaces)
        if (std::abs(glm::dot(frame.normal, surface.corners[0] - frame.centre)) > 1e-9 ||
            std::abs(glm::dot(frame.normal, surface.normal)) < 1 - 1e-9)
          project(frame, surface.corners, bitmap);
    }
  };
  const auto look = [&] {
    alignas(64) float visible[16];
    float sum = 0;
    for (std::size_t i = 0; i < directions.size(); i += 48) {
      bitmap.visibility16(&directions[i], &directions[i + 16], &directions[i + 32], visible);
      sum += visible[0];
    }
    keep(sum);
  };
  const std::vector<double> seconds = cpu_s_per_call({fill, look}, scene.repeat());
  section.add("bitmap_us", "all surfaces into one bitmap, R = 128", 1e6 * seconds[0] / frame_count, "µs");
  section.add("visibility16_ns", "bitmap visibility of 16 directions", 1e9 * seconds[1] / packet_count, "ns");
}

}  // namespace

Expected<Section> kernels_section(const BenchCase& scene) {
  const PacketScene packets(scene);
  Section section{"kernels", {}};
  add_form_factors(scene, packets, section);
  if (scene.stopped()) return BenchCase::interrupted();
  add_bitmaps(scene, section);
  return section;
}

}  // namespace lichthof::bench
