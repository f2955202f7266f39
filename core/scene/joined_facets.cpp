#include "core/scene/joined_facets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace lichthof {

namespace {

using Place = std::array<double, 3>;
Place place_of(const Vec3& p) { return {p.x, p.y, p.z}; }

/// The facets of one luminaire, by their edges.
class Facets {
 public:
  explicit Facets(Scene& scene) : scene_(scene) {
    for (std::uint32_t s = 0; s < scene.surfaces.size(); ++s)
      if (scene.material_of(scene.surfaces[s]).emits() && scene.surfaces[s].texcoords.empty()) {
        facets_.push_back(s);
        add_edges(s);
      }
  }

  /// @returns surfaces that are part of another now
  std::vector<std::uint8_t> join() {
    std::vector<std::uint8_t> is_gone(scene_.surfaces.size(), 0);
    // Rows become strips in one round, strips become rectangles in the next.
    for (bool joined = true; joined;) {
      joined = false;
      for (const std::uint32_t s : facets_)
        while (!is_gone[s]) {
          const std::optional<std::uint32_t> other = join_one(s);
          if (!other) break;
          is_gone[*other] = 1;
          joined = true;
        }
    }
    return is_gone;
  }

 private:
  using Edge = std::pair<Place, Place>;

  Edge edge_of(const Surface& surface, std::size_t k) const {
    const Polygon& corners = surface.corners;
    return {place_of(corners[k]), place_of(corners[(k + 1) % corners.size()])};
  }
  void add_edges(std::uint32_t s) {
    for (std::size_t k = 0; k < scene_.surfaces[s].corners.size(); ++k) by_edge_[edge_of(scene_.surfaces[s], k)] = s;
  }
  void remove_edges(std::uint32_t s) {
    for (std::size_t k = 0; k < scene_.surfaces[s].corners.size(); ++k) {
      const auto found = by_edge_.find(edge_of(scene_.surfaces[s], k));
      if (found != by_edge_.end() && found->second == s) by_edge_.erase(found);
    }
  }

  /// Joins the facet with its neighbour across the longest edge that allows it.
  std::optional<std::uint32_t> join_one(std::uint32_t s) {
    Surface& own = scene_.surfaces[s];
    std::optional<std::uint32_t> best;
    Polygon best_outline;
    double best_length = 0;
    for (std::size_t k = 0; k < own.corners.size(); ++k) {
      const Edge edge = edge_of(own, k);
      const auto found = by_edge_.find({edge.second, edge.first});
      if (found == by_edge_.end() || found->second == s || !is_one_plane(own, scene_.surfaces[found->second])) continue;
      const double length = glm::length(own.corners[(k + 1) % own.corners.size()] - own.corners[k]);
      if (length <= best_length * (1 + 1e-9)) continue;
      Polygon outline = joined(own, k, scene_.surfaces[found->second]);
      if (outline.empty()) continue;
      best = found->second, best_outline = std::move(outline), best_length = length;
    }
    if (!best) return std::nullopt;
    remove_edges(s), remove_edges(*best);
    own.area += scene_.surfaces[*best].area;
    own.corners = std::move(best_outline);
    add_edges(s);
    return best;
  }

  bool is_one_plane(const Surface& a, const Surface& b) const {
    constexpr double same = 1e-6;
    if (a.material != b.material || glm::dot(a.normal, b.normal) <= 1 - same * same) return false;
    const double size = std::sqrt(a.area + b.area);
    return std::ranges::all_of(
        b.corners, [&](const Vec3& c) { return std::abs(glm::dot(c - a.corners[0], a.normal)) <= same * size; });
  }

  /// Both outlines as one, corners on a straight line left out; empty where that is not convex.
  /// @param k  number of the common edge in a
  static Polygon joined(const Surface& a, std::size_t k, const Surface& b) {
    constexpr std::size_t most_corners = 64;
    const std::size_t na = a.corners.size(), nb = b.corners.size();
    const Vec3 &from = a.corners[k], &to = a.corners[(k + 1) % na];
    const auto start =
        static_cast<std::size_t>(std::find(b.corners.begin(), b.corners.end(), from) - b.corners.begin());
    Polygon ring;
    for (std::size_t i = 1; i <= na; ++i) ring.push_back(a.corners[(k + i) % na]);         // to … from
    for (std::size_t i = 1; i + 1 < nb; ++i) ring.push_back(b.corners[(start + i) % nb]);  // between from and to
    if (start == nb || b.corners[(start + nb - 1) % nb] != to) return {};
    Polygon outline;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vec3 in = ring[i] - ring[(i + ring.size() - 1) % ring.size()], out = ring[(i + 1) % ring.size()] - ring[i];
      const double turn = glm::dot(glm::cross(in, out), a.normal), straight = 1e-9 * glm::length(in) * glm::length(out);
      if (turn < -straight) return {};
      if (turn > straight) outline.push_back(ring[i]);
    }
    return outline.size() >= 3 && outline.size() <= most_corners ? outline : Polygon{};
  }

  Scene& scene_;
  std::vector<std::uint32_t> facets_;
  std::map<Edge, std::uint32_t> by_edge_;
};

}  // namespace

std::size_t join_facets(Scene& scene) {
  const std::vector<std::uint8_t> is_gone = Facets(scene).join();
  std::size_t kept = 0;
  for (std::size_t s = 0; s < scene.surfaces.size(); ++s)
    if (!is_gone[s]) {
      if (kept != s) scene.surfaces[kept] = std::move(scene.surfaces[s]);
      ++kept;
    }
  const std::size_t fewer = scene.surfaces.size() - kept;
  scene.surfaces.resize(kept);
  return fewer;
}

}  // namespace lichthof
