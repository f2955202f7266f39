/// The light of one cell: its receivers, what they have received and shot, and the transfer of one shot into them.
///
/// This is all physics and no protocol: core/cell decides who shoots when and where a shot travels; this file only knows
/// how to distribute one.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/ids.hpp"
#include "core/base/parallel.hpp"
#include "core/light/expected_light.hpp"
#include "core/light/hemicube_bitmap.hpp"
#include "core/light/solution.hpp"
#include "core/scene/mesh.hpp"

namespace lichthof {

/// One shooting patch inside a shot: its polygon and what each of its places distributes.
struct ShotPatch {
  std::vector<Vec2> corners;           ///< plane coordinates of Shot (m)
  std::uint8_t branch = 0;             ///< Patch::branch
  std::uint8_t columns = 1, rows = 1;  ///< places on the bounding rectangle lo..hi
  Vec2 lo, hi;
  std::vector<Rgbf> delta;  ///< unshot radiosity per grid place, column fastest (W/m²), signed
  std::vector<float> area;  ///< at each place (m²), 0 where the polygon leaves none
  std::vector<float>
      openness;         ///< likewise, in [0, 1]: what stands for the patch is where it is open; 0: veiled (core/light/openness)
  Rgbf reflected{0.f};  ///< area mean of delta without emission; delta mean = reflected + emitted
  Rgbf emitted{0.f};    ///< own emission in this shot (W/m²): what makes it direct light
};

/// One distribution of unshot radiosity, self-contained: any cell can receive it (the paper's copy of the shooting patch).
struct Shot {
  ShotId id;
  SceneVersion version;
  GroupId group;  ///< who shoots
  Plane plane;
  std::vector<Vec2> corners;  ///< polygon of the whole group, plane coordinates
  Vec3 centre;                ///< the hemicube stands here (m)
  double radius = 0;          ///< m
  double area = 0;            ///< m²
  std::vector<ShotPatch> patches;
  HemicubeFrame frame() const { return {centre, plane.u, plane.v, plane.normal}; }
  /// Power that leaves with this shot (W, signed per channel).
  Rgb power() const;
  std::size_t wire_bytes() const;  ///< size of the shot's copy in a message
};

/// A cell that a shot travels on to.
struct NextCell {
  Box box;
  Box reach;  ///< around it and all cells behind it that the shot can reach by it
};

/// What a cell lets pass to the next.
struct Passage {
  HemicubeBitmap bitmap;  ///< for those that receive the shot
  /// The same with walls that the next cell's rays judge but that have no opening towards it: where that leaves nothing free, nothing
  /// comes. Empty where there are none.
  HemicubeBitmap walled;
};

struct TransferWork {
  std::uint64_t rays = 0;             ///< shadow rays answered
  std::uint64_t rays_saved = 0;       ///< those answered without the ray tracer, see core/light/shadows
  std::uint64_t rays_remembered = 0;  ///< those of them that an earlier shot had asked, see core/light/visibility_cache
  std::uint64_t form_factors = 0, clusters_tested = 0, clusters_behind = 0, clusters_hidden = 0, clusters_cut = 0;
  Rgb received{0.0};  ///< power that arrived in this cell (W)
};

struct TransferOptions {
  TransferMethod method = TransferMethod::rays;
  std::uint32_t hemicube_resolution = 128;
  double near_factor = 1.0;   ///< receivers nearer than this many patch radii see the elements one by one
  double group_factor = 3.0;  ///< receivers beyond this many group radii see the group as one
  /// Receivers so far away that a shot brings them less than this share of what the scene's receivers get of it on average are
  /// skipped: all that is lost is below this share of the shot, however many and small they are.
  double contribution_cut = 1e-3;
  /// Memory for what shadow rays answered to the cell's own shots, for when their groups shoot again (core/light/visibility_cache).
  std::size_t visibility_cache_bytes = std::size_t{128} << 20;
};

/// Sums over the cell that the machines exchange (W, per channel).
struct CellPower {
  Rgb unshot{0.0};  ///< Σ (E + ρH - S) A
  Rgb unshot_absolute{0.0};
  Rgb emitted{0.0};   ///< Σ E A
  Rgb absorbed{0.0};  ///< Σ (1-ρ) H A
  Rgb shot{0.0};      ///< Σ S A
  Rgb received{0.0};  ///< Σ H A
  double area = 0;    ///< m² of lit patches
};

class CellLight {
 public:
  /// @param groups  the groups of the cell, any order; dormant ones are left out of the receivers
  /// @param box     the cell's box; rays and bitmaps meet what concerns it (core/light/cell_surfaces); an infinite box holds all
  /// @param exchange  of all groups of the mesh, where cells share it; else it is measured here
  CellLight(std::shared_ptr<const Scene> scene, std::shared_ptr<const Mesh> mesh, std::vector<GroupId> groups,
            const Box& box, const TransferOptions& options, std::shared_ptr<const Parallel> parallel,
            std::shared_ptr<const GroupExchange> exchange = nullptr);
  ~CellLight();
  CellLight(CellLight&&) noexcept;

  /// The group with the largest |unshot + expected| power times its weight, where *expected* is what the light that it will still
  /// receive of this cell's own would make it send (core/light/expected_light), and the weight says how much that matters where it
  /// arrives (core/light/group_exchange). power_w is that selection key (W, summed over channels); 0 if none.
  struct Candidate {
    GroupId group;
    double power_w = 0;
  };
  Candidate strongest() const;

  /// Largest emitted power of a group of this cell (W): the scale of eps.
  double largest_initial_power() const;

  /// Moves the group's unshot (and expected) radiosity into S and returns it. @post its unshot is minus the expected part
  Shot take_shot(GroupId group, ShotId id, SceneVersion version);

  /// Adds a shot to the receivers of this cell.
  /// @param incoming  bitmap of occluders in nearer cells; nullptr for a shot of this very cell
  TransferWork receive(const Shot& shot, const HemicubeBitmap* incoming);

  /// Covers the bitmap's pixels by this cell's surfaces, for each cell that it is sent to and those behind it. Left out is what
  /// lies within the reach of that cell's own rays: an opening near its border is seen place by place, as inside of a cell.
  /// @param next  cells beside this one that it is sent to
  /// @returns     one for each of those
  std::vector<Passage> project(const Shot& shot, std::span<const NextCell> next, const HemicubeBitmap& bitmap) const;

  void set_emission(std::uint32_t material, const Rgb& radiance);  ///< E moves, so unshot moves; no shot needed (§2.1)
  void set_reflectance(std::uint32_t material, const Rgb& reflectance);  ///< ρ moves, H is kept (§2.1)

  CellPower power() const;
  /// Copies this cell's elements into the global arrays of the solution, and back (resume). Solution::pending is for set_pending()
  /// to find, from all cells.
  void store(Solution& solution) const;
  void load(const Solution& solution);
  /// Elements, trees and ray scene of this cell alone; not the scene and the mesh, which the cells of a process share (bytes).
  std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lichthof
