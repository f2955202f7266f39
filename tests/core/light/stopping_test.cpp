#include "core/light/stopping.hpp"

#include <doctest/doctest.h>

#include "tests/support/rooms.hpp"

using namespace lichthof;
using namespace lichthof::test;

namespace {

struct Room {
  Room() { add_box(scene, {0, 0, 0}, {4, 4, 3}, add_material(scene, diffuse(0.5)), true); }
  double eps(TransferMethod method = TransferMethod::rays) const {
    MeshOptions options;
    options.patch_size = 1;
    return default_eps(scene, mesh_of(scene, options, lit), method);
  }
  Scene scene;
  std::vector<LitSides> lit = std::vector<LitSides>(6, {true, false});
};

}  // namespace

TEST_CASE("stopping: where nothing is hidden, light is shot to a smaller rest") {
  const Room empty;
  CHECK(empty.eps() == 1e-5);
  CHECK(empty.eps(TransferMethod::hemicube) == 5e-4);  // its item buffers err more than any rest

  for (const double below_ceiling : {0.0, 1e-3, 0.5}) {
    Room with_lamp;
    add_rectangle(with_lamp.scene, {1, 1, 3 - below_ceiling}, {0, 1, 0}, {1, 0, 0},
                  add_material(with_lamp.scene, luminous(10)));
    with_lamp.lit.push_back({true, below_ceiling > 0});
    CAPTURE(below_ceiling);
    CHECK(with_lamp.eps() == (below_ceiling > 0 ? 2e-3 : 1e-5));
  }

  Room of_pillars;
  add_box(of_pillars.scene, {1, 1, 0}, {1.2, 1.2, 3}, 0, false);
  of_pillars.lit.resize(12, {true, false});
  CHECK(of_pillars.eps() == 2e-3);
}

TEST_CASE("stopping: the backs of what stands free see the rest of the scene") {
  Scene scene;
  const std::uint32_t grey = add_material(scene, diffuse(0.5));
  add_rectangle(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, grey);
  const Mesh one = mesh_of(scene, {1, 0, 100}, {});
  CHECK(nothing_is_hidden(scene, one));
  add_rectangle(scene, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, grey);
  CHECK(!nothing_is_hidden(scene, mesh_of(scene, {1, 0, 100}, {})));
}
