/// One shot into the receivers of one cell: analytic form factors, shadow rays in the own cell, bitmap for foreign ones.
///
/// Per cluster of 16 receivers the shooter is seen as a whole group from afar, as its quarters and patches nearer by, and element
/// by element, with signed unshot radiosity, when it is about as near as it is large (numerics: near field, hierarchical shooters).
#pragma once

#include "core/light/cell_light.hpp"
#include "core/light/item_visibility.hpp"
#include "core/light/occluders.hpp"
#include "core/light/radiosity.hpp"
#include "core/light/raycast.hpp"
#include "core/light/receiver_tree.hpp"
#include "core/light/shadows.hpp"
#include "core/light/visibility_cache.hpp"

namespace lichthof {

struct TransferScene {
  const Mesh& mesh;
  const ReceiverTree& tree;
  const RayScene& rays;
  const Occluders& occluders;       ///< the surfaces of the cell, index as RayScene's hits
  const ElementOutlines& outlines;  ///< only for the method `hemicube`
  const TransferOptions& options;
  const Vec3& origin;
  float reach;                         ///< m; see reach_of()
  const GroupExchange& exchange;       ///< of the mesh
  bool in_hulls = true;                ///< see core/light/shadows
  VisibilityCache* answers = nullptr;  ///< of earlier shots into this scene; nullptr: every ray is asked anew
  PacketObserver* observer = nullptr;  ///< with one thread only
};

/// The distance beyond which a shot counts for nothing: a receiver at distance d gets at most 1 / (π d²) of its power (1/m²), and
/// all receivers together on average 1 / A. @param area  A, of all patches (m²)
float reach_of(double area, const TransferOptions& options);

/// Adds the shot to `light`. @param incoming bitmap of nearer cells, nullptr in the shooter's own cell
/// @cost  about 0.3 µs per visible cluster, nearly all of it the kernel of the shadow rays
TransferWork transfer(const Shot& shot, const HemicubeBitmap* incoming, const TransferScene& scene, Radiosity& light,
                      const Parallel& parallel);

}  // namespace lichthof
