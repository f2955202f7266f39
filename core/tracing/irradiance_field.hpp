/// Smooth look-up of what the elements know: the value at a point of a plane, without seams and without leaks. This file
/// replaces the paper's constant ambient term (§3): "a radiosity value obtained from the first pass".
///
/// Every element spreads a tent over itself and half of its neighbours, as wide as the element itself:
///
///     value(p) = Σ w_i v_i + G·(p − Σ w_i c_i),   w_i ∝ share_i · tent((p − m_i)/size_i),  Σ w_i = 1,  G = Σ w_i g_i
///
/// with m_i the middle of the element's rectangle, c_i the centre of gravity of what the patch leaves of it, share_i the
/// part that is left, g_i a limited slope fitted to the neighbours. On a uniform grid this is bilinear interpolation; at
/// the rim of a plane and at T-vertices the slope carries on; linear fields are exact everywhere. All weights are
/// continuous, so there is no seam between patches, groups or coplanar surfaces. Elements beyond a contact line are left
/// out (see contact_lines).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <ranges>
#include <span>
#include <vector>

#include "core/base/footprint.hpp"
#include "core/scene/element_grids.hpp"
#include "core/scene/mesh.hpp"
#include "core/scene/scene.hpp"
#include "core/tracing/contact_lines.hpp"

namespace lichthof {

/// The geometry of the look-up, shared by all quantities on one mesh: planes, bins of patches, contact lines.
class FieldGeometry {
 public:
  FieldGeometry(const Scene& scene, std::shared_ptr<const Mesh> mesh);

  const Mesh& mesh() const { return *mesh_; }

  struct Weighted {
    std::uint32_t element;
    float weight;
  };
  /// Elements around a point with their weights (not normalised), those beyond contact lines left out.
  struct Neighbours {
    std::array<Weighted, 32> items;
    std::uint32_t count = 0;
    Vec2 at{0.0};  ///< the point in plane coordinates
  };
  /// @returns no neighbours where the side has no lit patches. @cost about 100 ns
  void find(SurfaceId surface, bool back, const Vec3& point, Neighbours& found) const;

  /// The element that holds the point, if the side has one there.
  std::optional<std::uint32_t> element_at(SurfaceId surface, bool back, const Vec3& point) const;
  /// True where a contact line is near: constant values would leak there.
  bool near_contact(SurfaceId surface, bool back, const Vec3& point) const;

  /// Elements that touch this one or share a corner with it, and no contact line runs between their centres.
  std::vector<std::uint32_t> touching(std::uint32_t element) const;
  Vec2 centre(std::uint32_t element) const { return mesh_->elements[element].centre; }
  Vec2 size_of(std::uint32_t element) const {
    return grids_[patch_of_[element]].step * static_cast<double>(mesh_->elements[element].span);
  }
  /// Without the mesh.
  std::size_t memory_bytes() const {
    return bytes_of_all(plane_of_side_, planes_, bin_first_, bin_patches_, contact_first_, contacts_, grids_, patch_of_, share_) +
           elements_.memory_bytes();
  }

 private:
  static constexpr std::uint32_t none = ElementGrids::none;
  /// The grid of one patch's smallest elements.
  struct PatchGrid {
    Vec2 lo{0.0}, step{0.0}, inverse_step{0.0};
    int columns = 0, rows = 0;
    int spans = 0;   ///< Element::span of all elements, by or: each is a power of 2
    int widest = 1;  ///< the largest of them
    std::uint32_t surface = 0;
    bool back = false;
  };
  struct PlaneBins {
    Vec2 lo{0.0}, inverse_size{0.0};
    int columns = 0, rows = 0;
    std::uint32_t first = 0;  ///< of its bins
    double tolerance = 0;     ///< m; nearer to a contact line counts as on it
  };

  void file_patches();
  void find_contacts(const Scene& scene);
  std::uint32_t bin_of(const PlaneBins& bins, const Vec2& p) const;
  auto elements_of(std::uint32_t patch) const {
    const Patch& p = mesh_->patches[patch];
    return std::views::iota(p.first_element, p.first_element + p.element_count);
  }
  static Vec2 widest_size(const PatchGrid& grid) { return grid.step * static_cast<double>(grid.widest); }
  bool separated(const PlaneBins& bins, std::uint32_t bin, const Vec2& point, const Vec2& centre) const;
  void nearest_visible(const PlaneBins& bins, std::uint32_t bin, Neighbours& found) const;

  std::shared_ptr<const Mesh> mesh_;
  ElementGrids elements_;
  std::vector<std::uint32_t> plane_of_side_;  ///< 2 * surface + back → plane, or none
  std::vector<PlaneBins> planes_;
  std::vector<std::uint32_t> bin_first_;  ///< patches of bin b: bin_patches_[bin_first_[b] .. bin_first_[b + 1])
  std::vector<std::uint32_t> bin_patches_;
  std::vector<std::uint32_t> contact_first_;
  std::vector<ContactLine> contacts_;
  std::vector<PatchGrid> grids_;
  std::vector<std::uint32_t> patch_of_;  ///< of each element
  std::vector<float> share_;             ///< of each element: area over area of its rectangle
};

/// One quantity (W/m²) on that geometry. Immutable; any number of threads may ask at once.
class IrradianceField {
 public:
  /// @param values  one per element of the mesh
  IrradianceField(std::shared_ptr<const FieldGeometry> geometry, std::span<const Rgb> values);

  /// Value at a point of a surface side (W/m²), ≥ 0; zero where the side has no lit patches. @cost about 150 ns
  Rgb at(SurfaceId surface, bool back, const Vec3& point) const;
  const FieldGeometry& geometry() const { return *geometry_; }
  std::size_t memory_bytes() const { return bytes_of(nodes_); }

 private:
  struct Node {
    Rgbf value{0.f}, slope_u{0.f}, slope_v{0.f};
  };
  Node fitted(std::uint32_t element, std::span<const Rgb> values) const;

  std::shared_ptr<const FieldGeometry> geometry_;
  std::vector<Node> nodes_;
};

}  // namespace lichthof
