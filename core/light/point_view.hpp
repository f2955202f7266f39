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
    double slope = 0;  ///< of the height in the plane
    double height(const Vec2& p) const { return u * p.x + v * p.y + offset; }
  };
  /// A convex piece in coordinates of the source's plane, within a circle about one of its places.
  struct Piece {
    std::uint32_t first = 0, count = 0;  ///< range of corners
    Vec2 middle{0.0};
    double radius = 0;
  };
  struct Pieces {
    std::vector<Vec2> corners;
    std::vector<Piece> all;
    void clear() { corners.clear(), all.clear(); }
    void add(std::span<const Vec2> corners_of_piece);
    void add(std::span<const Vec2> corners_of_piece, Piece known);
    std::span<const Vec2> corners_of(const Piece& piece) const { return {corners.data() + piece.first, piece.count}; }
  };
  /// The corners of one piece while it is cut.
  struct Ring {
    std::vector<Vec2> corner;  ///< room for more than count
    std::size_t count = 0;
    void clear(std::size_t most) {
      count = 0;
      if (corner.size() < most) corner.resize(most);
    }
    void push(const Vec2& p) { corner[count++] = p; }
    std::span<const Vec2> corners() const { return {corner.data(), count}; }
  };
  void lay_plane(std::span<const Vec3> source);
  void find_cone();
  bool is_beside(const Obstruction& obstruction, const Vec3& point) const;
  bool find_shadow(const Obstruction& obstruction, const Vec3& point);
  bool misses(const Pieces& pieces, const Piece& piece) const;
  void cut(const Piece& piece);
  bool split(const Line& line);
  double seen(const Vec3& normal);

  double tolerance_;
  Vec3 origin_, along_u_, along_v_;  ///< of the source's plane; the origin relative to the point
  std::vector<Vec3> cone_;           ///< unit normals of the sides through the source's edges, outwards
  std::vector<Vec3> sides_;
  std::vector<Line> shadow_;
  Pieces whole_, now_, next_;
  Ring rest_, inside_, outside_;
  std::vector<double> heights_;
  std::vector<Vec3> seen_;
};

}  // namespace lichthof
