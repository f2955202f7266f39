/// What a point sees of a polygon behind obstructions: exactly, by cutting their shadows out of the polygon.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/types.hpp"
#include "core/light/view_shaft.hpp"

namespace lichthof {

class PointView {
 public:
  /// @param tolerance  slivers that are nowhere wider are left as they are (m)
  explicit PointView(double tolerance) : tolerance_(tolerance) {}

  struct Factors {
    double unobstructed = 0, visible = 0;  ///< form factors in [0, 1] (1)
  };

  /// Form factor from a point to a polygon as if nothing stood between, and to the part that can be seen.
  ///
  /// An obstruction's shadow is the polygon's part within the pyramid from the point through the obstruction's edges; what is
  /// left falls into convex pieces, each with Lambert's closed form.
  ///
  /// @param source        convex, counter-clockwise seen from the point, all of it above the point's horizon
  /// @param obstructions  of which those in `which` count, the likeliest to hide much first
  /// @pre   obstructions lie above the horizon and in front of the source's plane; solids do not hold the point
  /// @error rounding, and the tolerance times the angle at which the source's perimeter is seen
  /// @cost  about 0.1 µs per obstruction and piece; the pieces are few where shadows fall together
  /// @source [Baum89] for the form factor, [Sutherland74] for the cuts
  Factors factors(const Vec3& point, const Vec3& normal, std::span<const Vec3> source,
                  std::span<const Obstruction> obstructions, std::span<const std::uint32_t> which);

 private:
  /// Where a pyramid's side meets the source's plane: positive inwards, in units of the height over the side.
  struct Line {
    double u = 0, v = 0, offset = 0;
    double height(const Vec2& p) const { return u * p.x + v * p.y + offset; }
  };
  /// Convex pieces, corners in coordinates of the source's plane.
  struct Pieces {
    std::vector<Vec2> corners;
    std::vector<std::uint32_t> ends;  ///< one past the last corner of each
    void clear() { corners.clear(), ends.clear(); }
    std::span<const Vec2> piece(std::size_t k) const {
      const std::uint32_t first = k == 0 ? 0 : ends[k - 1];
      return {corners.data() + first, ends[k] - first};
    }
    void add(std::span<const Vec2> piece) {
      corners.insert(corners.end(), piece.begin(), piece.end());
      ends.push_back(static_cast<std::uint32_t>(corners.size()));
    }
  };
  void lay_plane(std::span<const Vec3> source);
  bool find_shadow(const Obstruction& obstruction, const Vec3& point);
  bool misses(std::span<const Vec2> piece) const;
  void cut(std::span<const Vec2> piece);
  bool split(std::span<const Vec2> piece, const Line& line);
  double seen(const Vec3& normal);

  double tolerance_;
  Vec3 origin_, along_u_, along_v_;  ///< of the source's plane; the origin relative to the point
  std::vector<Vec3> sides_;
  std::vector<Line> shadow_;
  Pieces now_, next_;
  std::vector<Vec2> whole_, rest_, inside_, outside_;
  std::vector<double> heights_;
  std::vector<Vec3> seen_;
};

}  // namespace lichthof
