/// Light that is exact and cheap: a handful of small square patches per cell, point-to-disc form factors, opaque
/// rectangles as walls. It is linear, knows its exact solution, and stands in for CellLight where a test is about protocol.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "core/base/random.hpp"
#include "core/cell/light_of_cell.hpp"
#include "core/light/bit_projector.hpp"
#include "core/scene/partition.hpp"

namespace lichthof::test {

struct ToyPatch {
  Vec3 centre, normal;
  double area = 0;  ///< representable in single precision, as a shot carries it
  Rgb emission{0.0}, reflectance{0.0};
  std::uint32_t material = 0;
  Rgb irradiance{0.0}, shot{0.0};
  Rgb unshot() const { return emission + reflectance * irradiance - shot; }
};

/// A wall: convex, planar, opaque, belongs to one cell.
using ToyWall = Polygon;

struct ToyWorld {
  std::shared_ptr<const CellGrid> grid;
  std::vector<std::vector<ToyPatch>> patches;  ///< per cell
  std::vector<std::vector<ToyWall>> walls;     ///< per cell
};

inline double power_of(const Rgb& radiosity, double area) {
  return area * (std::abs(radiosity.x) + std::abs(radiosity.y) + std::abs(radiosity.z));
}

/// Share of what leaves the receiver's point that meets the shooter's disc; 0 when they do not face each other.
inline double disc_form_factor(const ToyPatch& receiver, const Vec3& centre, const Vec3& normal, double area) {
  const Vec3 d = centre - receiver.centre;
  const double r2 = glm::dot(d, d);
  const double cos_receiver = glm::dot(receiver.normal, d), cos_shooter = -glm::dot(normal, d);
  if (r2 == 0 || cos_receiver <= 0 || cos_shooter <= 0) return 0;
  return cos_receiver * cos_shooter / r2 * area / (std::numbers::pi * r2 + area);
}

inline bool wall_between(const ToyWall& wall, const Vec3& from, const Vec3& to) {
  const Vec3 n = newell_vector(wall);
  const double a = glm::dot(n, from - wall[0]), b = glm::dot(n, to - wall[0]);
  if (a * b >= 0) return false;
  const Vec3 hit = from + a / (a - b) * (to - from);
  for (std::size_t k = 0; k < wall.size(); ++k)
    if (glm::dot(n, glm::cross(wall[(k + 1) % wall.size()] - wall[k], hit - wall[k])) < 0) return false;
  return true;
}

class ToyLight final : public LightOfCell {
 public:
  ToyLight(const ToyWorld& world, CellId cell) : patches_(world.patches[cell.value]), walls_(world.walls[cell.value]) {}

  CellLight::Candidate strongest() const override {
    CellLight::Candidate best;
    for (std::uint32_t k = 0; k < patches_.size(); ++k)
      if (const double power = power_of(patches_[k].unshot(), patches_[k].area); power > best.power_w)
        best = {GroupId{k}, power};
    return best;
  }
  double largest_initial_power() const override {
    double largest = 0;
    for (const ToyPatch& patch : patches_) largest = std::max(largest, power_of(patch.emission, patch.area));
    return largest;
  }
  Shot take_shot(GroupId group, ShotId id, SceneVersion version) override {
    ToyPatch& patch = patches_[group.value];
    Shot shot;
    shot.id = id;
    shot.version = version;
    shot.plane.origin = shot.centre = patch.centre;
    shot.plane.normal = patch.normal;
    complete_frame(patch.normal, shot.plane.u, shot.plane.v);
    shot.area = patch.area;
    shot.radius = std::sqrt(patch.area / 2);
    const double half = std::sqrt(patch.area) / 2;
    shot.corners = {{-half, -half}, {half, -half}, {half, half}, {-half, half}};
    ShotPatch piece;
    piece.corners = shot.corners;
    piece.lo = shot.corners[0], piece.hi = shot.corners[2];
    piece.delta = {Rgbf{patch.unshot()}};
    piece.area = {static_cast<float>(patch.area)};
    piece.openness = {1.f};
    piece.reflected = piece.delta[0];
    patch.shot += Rgb{piece.delta[0]};
    shot.patches.push_back(std::move(piece));
    return shot;
  }
  TransferWork receive(const Shot& shot, const HemicubeBitmap* incoming) override {
    TransferWork work;
    const HemicubeFrame frame = shot.frame();
    const Rgb delta{shot.patches[0].delta[0]};
    for (ToyPatch& patch : patches_) {
      double visible = 1;
      if (incoming) visible = incoming->visibility(frame.to_local(patch.centre - shot.centre));
      for (const ToyWall& wall : walls_) visible *= !wall_between(wall, shot.centre, patch.centre);
      const Rgb received = visible * disc_form_factor(patch, shot.centre, shot.plane.normal, shot.area) * delta;
      patch.irradiance += received;
      work.received += patch.area * received;
      ++work.form_factors;
    }
    work.clusters_tested = 1;
    work.rays = patches_.size();  // what a hierarchy of walls would cost, not what the loop above does
    return work;
  }
  std::vector<Passage> project(const Shot& shot, std::span<const NextCell> next,
                                      const HemicubeBitmap& bitmap) const override {
    std::vector<Passage> covered(next.size(), {bitmap, {}});
    for (const ToyWall& wall : walls_)
      for (std::size_t k = 0; k < next.size(); ++k)
        if (!can_not_shadow(wall[0], glm::normalize(newell_vector(wall)), shot.centre, next[k].reach))
          lichthof::project(shot.frame(), wall, covered[k].bitmap);
    return covered;
  }
  void set_emission(std::uint32_t material, const Rgb& radiance) override {
    for (ToyPatch& patch : patches_)
      if (patch.material == material) patch.emission = std::numbers::pi * radiance;
  }
  void set_reflectance(std::uint32_t material, const Rgb& reflectance) override {
    for (ToyPatch& patch : patches_)
      if (patch.material == material) patch.reflectance = reflectance;
  }
  CellPower power() const override {
    CellPower power;
    for (const ToyPatch& patch : patches_) {
      power.unshot += patch.area * patch.unshot();
      power.unshot_absolute += patch.area * glm::abs(patch.unshot());
      power.emitted += patch.area * patch.emission;
      power.absorbed += patch.area * (Rgb{1.0} - patch.reflectance) * patch.irradiance;
      power.shot += patch.area * patch.shot;
      power.received += patch.area * patch.irradiance;
      power.area += patch.area;
    }
    return power;
  }
  const std::vector<ToyPatch>& patches() const { return patches_; }

 private:
  std::vector<ToyPatch> patches_;
  std::vector<ToyWall> walls_;
};

/// Unit cells with patches at random places (some on the sides of their cells), every third cell holding a light.
inline ToyWorld toy_world(const CellPosition& size, std::uint32_t patches_per_cell, std::uint64_t seed) {
  Random random(seed);
  std::array<std::vector<double>, 3> boundaries;
  for (int axis = 0; axis < 3; ++axis)
    for (std::uint32_t k = 1; k < size[axis]; ++k) boundaries[axis].push_back(k);
  Box bounds{Vec3{0.0}, Vec3{double(size[0]), double(size[1]), double(size[2])}};
  ToyWorld world;
  world.grid = std::make_shared<const CellGrid>(bounds, boundaries);
  world.patches.resize(world.grid->cell_count());
  world.walls.resize(world.grid->cell_count());
  for (CellId cell{0}; cell.value < world.grid->cell_count(); ++cell.value) {
    const Box box = world.grid->box(cell);
    for (std::uint32_t k = 0; k < patches_per_cell; ++k) {
      ToyPatch patch;
      patch.centre = box.lo + box.size() * Vec3{random.unit(), random.unit(), random.unit()};
      patch.normal = glm::normalize(Vec3{random.unit(), random.unit(), random.unit()} - 0.5);
      if (random.below(3) == 0) {  // a piece of wall on a side of the cell, facing inwards
        const int axis = static_cast<int>(random.below(3));
        const bool high = random.below(2);
        patch.normal = Vec3{0.0};
        patch.normal[axis] = high ? -1 : 1;
        patch.centre[axis] = high ? box.hi[axis] : box.lo[axis];
      }
      patch.area = static_cast<float>(0.05 + 0.15 * random.unit());
      patch.reflectance = 0.2 + 0.6 * Rgb{random.unit(), random.unit(), random.unit()};
      patch.material = random.below(4);
      if (k == 0 && cell.value % 3 == 0) patch.emission = Rgb{10, 8, 6}, patch.material = 9;
      world.patches[cell.value].push_back(patch);
    }
  }
  return world;
}

/// All cells of the world in one: the reference every partition has to reproduce.
inline ToyWorld undivided(const ToyWorld& world) {
  ToyWorld one;
  one.grid = std::make_shared<const CellGrid>(world.grid->bounds(), std::array<std::vector<double>, 3>{});
  one.patches.resize(1);
  one.walls.resize(1);
  for (const auto& patches : world.patches) one.patches[0].insert(one.patches[0].end(), patches.begin(), patches.end());
  for (const auto& walls : world.walls) one.walls[0].insert(one.walls[0].end(), walls.begin(), walls.end());
  return one;
}

inline std::vector<std::unique_ptr<LightOfCell>> toy_lights(const ToyWorld& world) {
  std::vector<std::unique_ptr<LightOfCell>> lights;
  for (CellId cell{0}; cell.value < world.grid->cell_count(); ++cell.value)
    lights.push_back(std::make_unique<ToyLight>(world, cell));
  return lights;
}

}  // namespace lichthof::test
