#include "core/light/openness.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "core/light/cell_light.hpp"
#include "tests/support/one_cell.hpp"
#include "tests/support/rooms.hpp"

using namespace lichthof;

namespace {

constexpr double patch_size = 0.5;

/// A floor of 4 x 4 m, and a closed cabinet on its middle if asked for; all elements of the floor.
struct Floor {
  /// @param shines  the cabinet does, inwards
  explicit Floor(double cabinet_height, bool shines = false) {
    auto scene = std::make_shared<Scene>();
    const std::uint32_t grey = test::add_material(*scene, test::diffuse(0.5));
    test::add_rectangle(*scene, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}, grey);
    if (cabinet_height > 0) test::add_box(*scene, {1, 1, 0}, {3, 3, cabinet_height}, grey, shines);
    const auto mesh = test::mesh_with(*scene, patch_size, false);
    const Vec3 origin = bounds(*scene).centre();
    const RayScene rays(*scene, scene->surfaces, origin, Glass::clear);
    std::vector<GroupId> groups;
    for (std::uint32_t g = 0; g < mesh->groups.size(); ++g) groups.push_back(GroupId{g});
    for (const unsigned threads : {1u, 2u}) {
      tree = receiver_tree(*mesh, groups, origin);
      std::vector<Vec3> shining(scene->surfaces.size(), Vec3{0.0});
      for (std::size_t k = 1; shines && k < shining.size(); ++k) shining[k] = scene->surfaces[k].normal;
      find_openness(tree, rays, shining, patch_size, Parallel(threads));
      std::vector<float> all;
      for (const Cluster& cluster : tree.clusters) all.insert(all.end(), cluster.openness, cluster.openness + 16);
      if (threads == 1)
        openness = all;
      else
        same_by_two = openness == all;
    }
    for (const Cluster& cluster : tree.clusters)
      for (int lane = 0; lane < 16; ++lane) {
        if (!(cluster.lanes >> lane & 1)) continue;
        const Patch& patch = mesh->patches[tree.patches[cluster.first_patch + cluster.patch[lane]].mesh_patch];
        if (patch.surface.value != 0 || patch.back) continue;
        const Vec3 at = Vec3{cluster.points.x[lane], cluster.points.y[lane], cluster.points.z[lane]} + origin;
        const double edge = std::max(std::abs(at.x - 2), std::abs(at.y - 2));
        if (edge < 0.9)
          under.push_back(cluster.openness[lane]);
        else if (edge > 1.7)
          outside.push_back(cluster.openness[lane]);
      }
  }
  ReceiverTree tree;
  std::vector<float> openness, under, outside;
  bool same_by_two = false;
};

}  // namespace

TEST_SUITE("openness") {
  TEST_CASE("openness: 1 where nothing is near, little under a cabinet, the less the lower it is") {
    const Floor bare(0), high(1.0), low(0.1);
    REQUIRE(bare.under.size() > 100);
    CHECK(*std::ranges::min_element(bare.under) == 1.f);
    CHECK(*std::ranges::min_element(bare.outside) == 1.f);
    CHECK(*std::ranges::max_element(high.under) < 0.2f);
    CHECK(*std::ranges::max_element(low.under) < *std::ranges::min_element(high.under));
    CHECK(*std::ranges::min_element(low.under) > 0.f);
    CHECK(*std::ranges::max_element(low.outside) > 0.9f);
    CHECK(*std::ranges::min_element(low.outside) > *std::ranges::max_element(high.under));
  }

  TEST_CASE("openness: none under a luminaire that shines on it from near, as ever beside it and far below one") {
    const Floor low(0.1, true), high(1.0, true);
    REQUIRE(low.under.size() > 100);
    CHECK(*std::ranges::max_element(low.under) == 0.f);
    CHECK(*std::ranges::min_element(low.outside) > 0.9f);
    CHECK(*std::ranges::max_element(high.under) > 0.f);
  }

  TEST_CASE("openness: the number of threads changes no bit") { CHECK(Floor(0.5).same_by_two); }
}
