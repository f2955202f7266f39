#include "core/light/convex_solids.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

namespace lichthof {

namespace {

using Place = std::array<std::int64_t, 3>;

constexpr std::uint32_t none = 0xffffffffu;
constexpr std::size_t most_planes = 64;

struct Edge {
  Vec3 from, to;                              ///< as its first face has it
  std::uint32_t first = none, second = none;  ///< faces on its left and right
  bool crowded = false;                       ///< more than two faces, or two that have it the same way
};

/// The edges of all surfaces, by the places of their ends.
class Edges {
 public:
  Edges(std::span<const Surface> surfaces, double tolerance) : surfaces_(surfaces), tolerance_(tolerance) {
    for (std::uint32_t i = 0; i < surfaces.size(); ++i) {
      const Polygon& corners = surfaces[i].corners;
      for (std::size_t k = 0; k < corners.size(); ++k) add(i, corners[k], corners[k + 1 < corners.size() ? k + 1 : 0]);
    }
  }
  Edge& between(const Vec3& from, const Vec3& to) { return edges_.at(key(from, to)); }

 private:
  Place place(const Vec3& p) const {
    const double step = std::max(tolerance_, 1e-300);
    return {std::llround(p.x / step), std::llround(p.y / step), std::llround(p.z / step)};
  }
  std::pair<Place, Place> key(const Vec3& from, const Vec3& to) const { return std::minmax(place(from), place(to)); }
  void add(std::uint32_t face, const Vec3& from, const Vec3& to) {
    const auto [at, added] = edges_.try_emplace(key(from, to), Edge{from, to, face});
    Edge& edge = at->second;
    if (added) return;
    edge.crowded |= edge.second != none || place(edge.from) == place(from);
    edge.second = face;
  }

  std::span<const Surface> surfaces_;
  double tolerance_;
  std::map<std::pair<Place, Place>, Edge> edges_;
};

/// Faces that hang together by edges, and those edges.
struct Shell {
  std::vector<std::uint32_t> faces;
  std::vector<const Edge*> edges;
  bool crowded = false;
};

Shell shell_from(std::uint32_t start, std::span<const Surface> surfaces, Edges& edges, std::vector<char>& visited) {
  Shell shell;
  shell.faces.push_back(start);
  visited[start] = 1;
  for (std::size_t at = 0; at < shell.faces.size(); ++at) {
    const Polygon& corners = surfaces[shell.faces[at]].corners;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Edge& edge = edges.between(corners[k], corners[k + 1 < corners.size() ? k + 1 : 0]);
      shell.crowded |= edge.crowded;
      if (edge.first == shell.faces[at]) shell.edges.push_back(&edge);
      for (const std::uint32_t face : {edge.first, edge.second})
        if (face != none && !visited[face]) visited[face] = 1, shell.faces.push_back(face);
    }
  }
  return shell;
}

/// The plane of the one face that may be missing. @returns no plane when open edges have none in common
std::optional<Obstruction::Plane> lid(const std::vector<const Edge*>& open) {
  const Vec3 first = open.front()->to - open.front()->from;
  Vec3 normal{0.0};
  for (const Edge* edge : open)
    if (const Vec3 n = glm::cross(first, edge->to - edge->from); glm::length(n) > glm::length(normal)) normal = n;
  if (glm::length(normal) == 0) return {};
  normal = glm::normalize(normal);
  return Obstruction::Plane{normal, glm::dot(normal, open.front()->from)};
}

/// Turns all planes outwards, with their rims. @returns false when corners lie on both sides of one
bool turn_outwards(Obstruction& shape, double tolerance) {
  for (std::uint32_t k = 0; k < shape.planes.size(); ++k) {
    Obstruction::Plane& plane = shape.planes[k];
    double least = 0, most = 0;
    for (const Vec3& p : shape.corners)
      least = std::min(least, plane.height(p)), most = std::max(most, plane.height(p));
    if (least < -tolerance && most > tolerance) return false;
    if (least >= -tolerance && most <= tolerance) return false;  // flat
    if (most > tolerance) plane.normal = -plane.normal, plane.offset = -plane.offset;
  }
  return true;
}

std::optional<ConvexSolid> solid_of(const Shell& shell, std::span<const Surface> surfaces, double tolerance) {
  if (shell.crowded || shell.faces.size() < 3 || shell.faces.size() >= most_planes) return {};
  ConvexSolid solid;
  Obstruction& shape = solid.shape;
  std::map<std::uint32_t, std::uint32_t> plane_of;
  for (const std::uint32_t face : shell.faces) {
    plane_of[face] = static_cast<std::uint32_t>(shape.planes.size());
    shape.planes.push_back({surfaces[face].normal, glm::dot(surfaces[face].normal, surfaces[face].corners[0])});
    for (const Vec3& corner : surfaces[face].corners)
      if (std::none_of(shape.corners.begin(), shape.corners.end(),
                       [&](const Vec3& known) { return glm::length(corner - known) <= tolerance; }))
        shape.corners.push_back(corner);
  }
  std::vector<const Edge*> open;
  for (const Edge* edge : shell.edges)
    if (edge->second == none) open.push_back(edge);
  if (!open.empty()) {
    const std::optional<Obstruction::Plane> plane = lid(open);
    if (!plane) return {};
    for (const Edge* edge : open)
      if (std::abs(plane->height(edge->from)) > tolerance || std::abs(plane->height(edge->to)) > tolerance) return {};
    plane_of[none] = static_cast<std::uint32_t>(shape.planes.size());
    shape.planes.push_back(*plane);
  }
  if (!turn_outwards(shape, tolerance)) return {};
  // A shell that looks inwards has every edge the other way round.
  const bool outwards = glm::dot(surfaces[shell.faces[0]].normal, shape.planes[0].normal) > 0;
  for (const std::uint32_t face : shell.faces)
    if ((glm::dot(surfaces[face].normal, shape.planes[plane_of[face]].normal) > 0) != outwards) return {};
  for (const Edge* edge : shell.edges) {
    const std::uint32_t left = plane_of.at(edge->first), right = plane_of.at(edge->second);
    shape.rims.push_back({edge->from, edge->to, outwards ? left : right, outwards ? right : left});
  }
  for (const Vec3& corner : shape.corners) shape.box.include(corner);
  solid.surfaces = shell.faces;
  return solid;
}

using Segment = std::pair<Vec3, Vec3>;

/// The outline of what a solid has in one of its planes, which pieces may share.
std::vector<Segment> outline_in(const Obstruction& solid, const Obstruction::Plane& plane, double tolerance) {
  const auto in_plane = [&](const Vec3& p) { return std::abs(plane.height(p)) <= tolerance; };
  const auto belongs = [&](std::uint32_t k) { return glm::dot(solid.planes[k].normal, plane.normal) > 1 - 1e-9; };
  std::vector<Segment> outline;
  for (const Obstruction::Rim& rim : solid.rims)
    if (in_plane(rim.from) && in_plane(rim.to) && belongs(rim.left) != belongs(rim.right))
      outline.emplace_back(rim.from, rim.to);
  return outline;
}

/// Whether a segment of one of two convex outlines in a plane has the other one outside.
bool apart(std::span<const Segment> first, std::span<const Segment> second, const Vec3& normal, double tolerance) {
  for (const auto& [sides, others] : {std::pair{first, second}, std::pair{second, first}}) {
    Vec3 middle{0.0};
    for (const Segment& side : sides) middle += (side.first + side.second) / (2.0 * static_cast<double>(sides.size()));
    for (const auto& [from, to] : sides) {
      Vec3 outwards = glm::cross(to - from, normal);
      if (glm::length(outwards) == 0) continue;
      outwards = glm::normalize(outwards);
      if (glm::dot(outwards, middle - from) > 0) outwards = -outwards;
      const auto beyond = [&, from = from](const Vec3& p) { return glm::dot(outwards, p - from) >= -tolerance; };
      if (std::all_of(others.begin(), others.end(),
                      [&](const Segment& other) { return beyond(other.first) && beyond(other.second); }))
        return true;
    }
  }
  return false;
}

}  // namespace

std::vector<ConvexSolid> convex_solids(std::span<const Surface> surfaces, double tolerance) {
  Edges edges(surfaces, tolerance);
  std::vector<char> visited(surfaces.size(), 0);
  std::vector<ConvexSolid> solids;
  for (std::uint32_t i = 0; i < surfaces.size(); ++i) {
    if (visited[i]) continue;
    if (std::optional<ConvexSolid> solid = solid_of(shell_from(i, surfaces, edges, visited), surfaces, tolerance))
      solids.push_back(std::move(*solid));
  }
  return solids;
}

bool is_outside(const ConvexSolid& solid, std::uint32_t surface, std::span<const Vec3> corners, const Vec3& normal,
                double tolerance) {
  const auto own = std::find(solid.surfaces.begin(), solid.surfaces.end(), surface);
  if (own != solid.surfaces.end())
    return glm::dot(normal, solid.shape.planes[static_cast<std::size_t>(own - solid.surfaces.begin())].normal) > 0;
  for (const Obstruction::Plane& plane : solid.shape.planes) {
    double least = 1e300, most = -1e300;
    for (const Vec3& p : corners) least = std::min(least, plane.height(p)), most = std::max(most, plane.height(p));
    if (least < -tolerance) continue;
    // In the plane of a face it looks into the solid where it covers the face.
    if (most > tolerance || glm::dot(normal, plane.normal) > 0) return true;
    std::vector<Segment> polygon;
    for (std::size_t k = 0; k < corners.size(); ++k)
      polygon.emplace_back(corners[k], corners[k + 1 < corners.size() ? k + 1 : 0]);
    if (apart(polygon, outline_in(solid.shape, plane, tolerance), normal, tolerance)) return true;
  }
  return false;
}

}  // namespace lichthof
