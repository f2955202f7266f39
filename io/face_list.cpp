#include "io/face_list.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <unordered_map>

#include "core/scene/polygon.hpp"
#include "io/text.hpp"

namespace lichthof::io {

namespace {

constexpr double weld_share = 1e-8;         // of the scene's size
constexpr double flat_share = 1e-6;         // of the face's size: Surface's own promise
constexpr double least_area_share = 1e-10;  // of the square of the face's size
constexpr std::size_t most_concave_corners = 10000;

using Corners = std::vector<std::uint32_t>;  // indices into FaceList::corners

double size_of(std::span<const Vec3> corners) {
  Box box;
  for (const Vec3& corner : corners) box.include(corner);
  return glm::length(box.size());
}

bool has_area(std::span<const Vec3> corners) {
  const double size = size_of(corners);
  return corners.size() >= 3 && size > 0 && area(corners) > least_area_share * size * size;
}

class Maker {
 public:
  Maker(const FaceList& faces, Scene& scene, ImportReport& report, bool keep_backs)
      : list_(faces), scene_(scene), report_(report), keep_backs_(keep_backs) {
    Box box;
    for (const Vec3& corner : list_.corners) box.include(corner);
    place_ = welded(list_.corners, weld_share * glm::length(box.size()));
  }
  Status make();

 private:
  Corners cleaned(const FaceList::Face& face) const;
  std::vector<std::uint32_t> ring_key(const Corners& corners, bool& reversed) const;
  void drop_duplicates();
  void settle_duplicate(std::size_t first, std::size_t second, bool opposite);
  std::optional<Error> add(std::size_t face);
  void add_piece(std::size_t face, const Corners& corners);
  void add_triangles(std::size_t face, const Corners& corners);
  Polygon points(const Corners& corners) const;
  void count_open_edges();

  const FaceList& list_;
  Scene& scene_;
  ImportReport& report_;
  bool keep_backs_;
  std::vector<std::uint32_t> place_;  ///< per corner: equal where welded
  std::vector<Corners> rings_;        ///< per face: corners without repetition; empty when dropped
};

/// Without corners in the place of their neighbour and without spikes (out and straight back).
Corners Maker::cleaned(const FaceList::Face& face) const {
  Corners ring;
  for (std::uint32_t i = face.first; i < face.first + face.count; ++i)
    if (ring.empty() || place_[ring.back()] != place_[i]) ring.push_back(i);
  while (ring.size() > 1 && place_[ring.front()] == place_[ring.back()]) ring.pop_back();
  for (std::size_t i = 0; i < ring.size() && ring.size() >= 3;) {
    const std::size_t n = ring.size(), before = (i + n - 1) % n, after = (i + 1) % n;
    if (place_[ring[before]] != place_[ring[after]]) {
      ++i;
      continue;
    }
    // The tip goes, and one of the two corners that now repeat each other.
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(std::max(i, after)));
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(std::min(i, after)));
    i = 0;
  }
  if (ring.size() < 3) ring.clear();
  return ring;
}

/// The same for every way to write the same closed polygon. @param reversed  set when this one runs the other way round
std::vector<std::uint32_t> Maker::ring_key(const Corners& corners, bool& reversed) const {
  std::vector<std::uint32_t> key;
  for (const std::uint32_t corner : corners) key.push_back(place_[corner]);
  std::rotate(key.begin(), std::min_element(key.begin(), key.end()), key.end());
  reversed = key[1] > key.back();
  if (reversed) std::reverse(key.begin() + 1, key.end());
  return key;
}

void Maker::settle_duplicate(std::size_t first, std::size_t second, bool opposite) {
  const bool first_emits = scene_.materials[list_.faces[first].material].emits();
  const bool second_emits = scene_.materials[list_.faces[second].material].emits();
  std::string line = list_.where(second) + ": the face has the corners of the one in " + list_.where(first) +
                     (opposite ? ", the other way round" : "");
  if (first_emits && second_emits && opposite)
    line += "; both emit, and the light of the second is lost: move them apart";
  else if (second_emits && !first_emits)
    line += "; the one that emits is kept";
  else
    line += "; dropped";
  report_.note("duplicate face", line);
  ++report_.duplicates_dropped;
  rings_[second_emits && !first_emits ? first : second].clear();
}

void Maker::drop_duplicates() {
  struct Seen {
    std::size_t face;
    bool reversed;
  };
  std::unordered_map<std::uint64_t, std::vector<Seen>> seen;
  seen.reserve(list_.faces.size());
  for (std::size_t face = 0; face < list_.faces.size(); ++face) {
    if (rings_[face].empty()) continue;
    bool reversed = false, other_reversed = false;
    const std::vector<std::uint32_t> key = ring_key(rings_[face], reversed);
    std::uint64_t hash = 1469598103934665603ull;
    for (const std::uint32_t place : key) hash = (hash ^ place) * 1099511628211ull, hash ^= hash >> 29;
    std::vector<Seen>& alike = seen[hash];
    const auto twin = std::find_if(alike.begin(), alike.end(), [&](const Seen& other) {
      return rings_[other.face].size() == key.size() && ring_key(rings_[other.face], other_reversed) == key &&
             !(keep_backs_ && other.reversed != reversed);
    });
    if (twin == alike.end()) {
      alike.push_back({face, reversed});
      continue;
    }
    settle_duplicate(twin->face, face, twin->reversed != reversed);
    if (rings_[twin->face].empty()) *twin = {face, reversed};
  }
}

Polygon Maker::points(const Corners& corners) const {
  Polygon result;
  for (const std::uint32_t corner : corners) result.push_back(list_.corners[corner]);
  return result;
}

void Maker::add_piece(std::size_t face, const Corners& corners) {
  Surface surface;
  surface.corners = points(corners);
  if (!has_area(surface.corners)) return;
  const Vec3 newell = newell_vector(surface.corners);
  surface.area = 0.5 * glm::length(newell);
  surface.normal = glm::normalize(newell);
  if (list_.faces[face].textured)
    for (const std::uint32_t corner : corners) surface.texcoords.push_back(list_.texcoords[corner]);
  surface.material = list_.faces[face].material;
  surface.source_face = static_cast<std::uint32_t>(face + 1);
  scene_.surfaces.push_back(std::move(surface));
}

/// A convex ring as the fan whose smallest triangle is largest: straight corners then make no sliver.
void Maker::add_triangles(std::size_t face, const Corners& corners) {
  const std::size_t n = corners.size(), candidates = std::min<std::size_t>(n, 16);
  std::size_t best = 0;
  double best_area = -1;
  const auto triangle = [&](std::size_t apex, std::size_t k) {
    return Corners{corners[apex], corners[(apex + k) % n], corners[(apex + k + 1) % n]};
  };
  for (std::size_t apex = 0; apex < candidates; ++apex) {
    double smallest = 1e300;
    for (std::size_t k = 1; k + 1 < n; ++k) smallest = std::min(smallest, area(points(triangle(apex, k))));
    if (smallest > best_area) best_area = smallest, best = apex;
  }
  for (std::size_t k = 1; k + 1 < n; ++k) add_piece(face, triangle(best, k));
}

std::optional<Error> Maker::add(std::size_t face) {
  const Corners& ring = rings_[face];
  const Polygon polygon = points(ring);
  const bool flat = flatness_defect(polygon) <= flat_share * size_of(polygon);
  if (flat && is_convex(polygon)) {
    add_piece(face, ring);
    return {};
  }
  if (ring.size() > most_concave_corners)
    return bad_input(list_.where(face), "a concave or bent face with " + std::to_string(ring.size()) +
                                            " corners; at most " + std::to_string(most_concave_corners) + " are read");
  const std::vector<std::vector<std::uint32_t>> pieces = convex_pieces(polygon);
  if (pieces.empty()) {
    ++report_.crossing_dropped;
    report_.note("crossing edges", list_.where(face) + ": the edges of the face cross each other; dropped");
    rings_[face].clear();
    return {};
  }
  ++(flat ? report_.concave_split : report_.nonplanar_split);
  for (const auto& piece : pieces) {
    Corners corners;
    for (const std::uint32_t i : piece) corners.push_back(ring[i]);
    flat ? add_piece(face, corners) : add_triangles(face, corners);
  }
  return {};
}

/// Edges between welded corners that only one face has. A corner in the middle of a neighbour's edge opens it, too.
void Maker::count_open_edges() {
  std::vector<std::uint64_t> edges;
  for (const Corners& ring : rings_) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const std::uint64_t a = place_[ring[i]], b = place_[ring[(i + 1) % ring.size()]];
      edges.push_back(std::min(a, b) << 32 | std::max(a, b));
    }
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i;
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    report_.open_edges += end - i == 1;
    i = end;
  }
}

Status Maker::make() {
  report_.faces_read = list_.faces.size();
  rings_.resize(list_.faces.size());
  for (std::size_t face = 0; face < list_.faces.size(); ++face) {
    rings_[face] = cleaned(list_.faces[face]);
    if (!rings_[face].empty() && has_area(points(rings_[face]))) continue;
    rings_[face].clear();
    ++report_.degenerate_dropped;
    report_.note("face without area", list_.where(face) + ": the face has no area; dropped");
  }
  drop_duplicates();
  for (std::size_t face = 0; face < list_.faces.size(); ++face) {
    if (rings_[face].empty()) continue;
    if (auto error = add(face)) return *error;
  }
  count_open_edges();
  report_.surfaces_made = scene_.surfaces.size();
  return Done{};
}

}  // namespace

std::uint32_t FaceList::group(const std::string& name) {
  const auto known = std::find(groups.begin(), groups.end(), name);
  if (known == groups.end()) return groups.push_back(name), static_cast<std::uint32_t>(groups.size() - 1);
  return static_cast<std::uint32_t>(known - groups.begin());
}

std::string FaceList::where(std::size_t face) const { return at_line(parts[faces[face].part], faces[face].line); }

std::vector<std::uint32_t> welded(std::span<const Vec3> points, double tolerance) {
  struct Key {
    std::int64_t x, y, z;
    bool operator==(const Key&) const = default;
  };
  struct Hash {
    std::size_t operator()(const Key& k) const {
      std::uint64_t h = static_cast<std::uint64_t>(k.x) * 0x9E3779B97F4A7C15ull;
      h = (h ^ (h >> 32) ^ static_cast<std::uint64_t>(k.y)) * 0xC2B2AE3D27D4EB4Full;
      h = (h ^ (h >> 29) ^ static_cast<std::uint64_t>(k.z)) * 0x165667B19E3779F9ull;
      return h ^ (h >> 32);
    }
  };
  // Counted from a corner of the box: far from the origin the steps would not fit into an integer.
  Box box;
  for (const Vec3& p : points) box.include(p);
  const double step = std::max(tolerance, 1e-18 * (1.0 + glm::length(box.size())));
  std::unordered_map<Key, std::uint32_t, Hash> places;
  places.reserve(points.size());
  std::vector<std::uint32_t> result;
  result.reserve(points.size());
  for (const Vec3& p : points) {
    const Vec3 q = (p - box.lo) / step;
    const Key key{std::llround(q.x), std::llround(q.y), std::llround(q.z)};
    result.push_back(places.try_emplace(key, static_cast<std::uint32_t>(places.size())).first->second);
  }
  return result;
}

Status make_surfaces(const FaceList& faces, Scene& scene, ImportReport& report, bool keep_backs) {
  return Maker(faces, scene, report, keep_backs).make();
}

}  // namespace lichthof::io
