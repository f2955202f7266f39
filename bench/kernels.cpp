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

constexpr std::size_t shot_count = 32,
                      clusters_per_shot = 16;  // of 16 receivers: a shot meets many clusters with one patch
constexpr std::uint32_t resolution = 128;
constexpr std::size_t frame_count = 16, packet_count = 256;

/// 16 receivers, for the kernels and for the scalar form factor.
struct Receiving {
  Receivers16 receivers;
  std::vector<Vec3> points, normals;
};

/// A patch, and clusters of 16 receivers that see it.
struct PatchShot {
  FlatShooter flat;
  Aim16 aim;
  std::vector<Vec3> corners;  ///< of the patch, local
  std::vector<Receiving> clusters;
};

PatchShot shot_of(const Mesh& mesh, const Patch& patch, const Vec3& origin) {
  PatchShot shot;
  const Plane& plane = mesh.planes[patch.plane.value];
  for (const Vec2& corner : mesh.polygon(patch.polygon)) shot.corners.push_back(plane.point(corner) - origin);
  shot.flat = flat_shooter(shot.corners, plane.normal, Vec3{0.0});
  std::fill_n(shot.aim.x, 32, shot.flat.cx), std::fill_n(shot.aim.y, 32, shot.flat.cy);
  std::fill_n(shot.aim.z, 32, shot.flat.cz);
  return shot;
}

Receiving receiving(const Receivers16& r) {
  Receiving cluster{r, {}, {}};
  for (int lane = 0; lane < 16; ++lane) {
    cluster.points.emplace_back(r.x[lane], r.y[lane], r.z[lane]);
    cluster.normals.emplace_back(r.nx[lane], r.ny[lane], r.nz[lane]);
  }
  return cluster;
}

/// Shots of the scene whose receivers all see the patch, occluders left aside, horizons cutting it or not.
std::vector<PatchShot> shots_of(const BenchCase& scene, const PacketScene& packets) {
  std::vector<PatchShot> shots;
  const Mesh& mesh = *scene.mesh();
  Random random(11);
  Factors16 factors;
  clear_segments(factors.segments);
  for (std::size_t tries = 0; shots.size() < shot_count && tries < 100 * shot_count; ++tries) {
    const Patch& patch = mesh.patches[random.below(static_cast<std::uint32_t>(mesh.patches.size()))];
    if (patch.polygon.count > static_cast<std::uint32_t>(FlatShooter::max_corners)) continue;
    PatchShot shot = shot_of(mesh, patch, packets.origin);
    for (std::size_t looks = 0; shot.clusters.size() < clusters_per_shot && looks < 100 * clusters_per_shot; ++looks) {
      const Cluster& cluster =
          packets.tree.clusters[random.below(static_cast<std::uint32_t>(packets.tree.clusters.size()))];
      if (cluster.lanes == 0xffff &&
          kernels().factor16(cluster.points, 0xffff, shot.flat, shot.aim, 0, 1e-6f, factors) == 0xffff)
        shot.clusters.push_back(receiving(cluster.points));
    }
    if (shot.clusters.size() == clusters_per_shot) shots.push_back(std::move(shot));
  }
  return shots;
}

void add_form_factors(const BenchCase& scene, const PacketScene& packets, Section& section) {
  const std::vector<PatchShot> shots = shots_of(scene, packets);
  if (shots.empty()) return;
  Factors16 factors;
  clear_segments(factors.segments);
  std::vector<std::function<void()>> works{[&] {
    double sum = 0;
    for (const PatchShot& shot : shots)
      for (const Receiving& cluster : shot.clusters)
        for (std::size_t lane = 0; lane < 16; ++lane)
          sum += form_factor(cluster.points[lane], cluster.normals[lane], shot.corners);
    keep(sum);
  }};
  for (const Kernels& width : available_kernels())
    works.emplace_back([&, kernel = width.factor16] {
      float sum = 0;
      for (const PatchShot& shot : shots)
        for (const Receiving& cluster : shot.clusters) {
          kernel(cluster.receivers, 0xffff, shot.flat, shot.aim, 0, 1e-6f, factors);
          sum += factors.factor[0];
        }
      keep(sum);
    });
  const std::vector<double> seconds = cpu_s_per_call(works, scene.repeat());
  const double count = 16.0 * static_cast<double>(shots.size() * clusters_per_shot);
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
