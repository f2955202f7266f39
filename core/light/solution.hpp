/// What the first pass leaves behind: irradiance per element, with everything needed to resume, probe or render it.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/base/types.hpp"
#include "core/scene/mesh.hpp"
#include "core/scene/scene.hpp"

namespace lichthof {

/// How the first pass finds form factors and visibility.
enum class TransferMethod : std::uint8_t {
  rays,      ///< analytic factors, shadow rays in the own cell, bitmaps through the others
  hemicube,  ///< the paper's item buffer on the hemicube with analytic factors [Baum89]
};

struct SolveOptions {
  MeshOptions mesh;
  std::array<std::uint32_t, 3> cells{1, 1, 1};
  std::uint32_t hemicube_resolution = 128;  ///< pixels along an edge of the top face
  double eps = 2e-3;  ///< of the largest initial unshot power, weighed by where it arrives (core/light/group_exchange)
  TransferMethod method = TransferMethod::rays;
};

/// Energy of the first pass, summed over the channels (W). emitted = absorbed + escaped + unshot + residual.
struct EnergyLedger {
  double emitted = 0;   ///< Σ E A
  double absorbed = 0;  ///< Σ (1 - ρ) H A, without `mirrored`
  double escaped = 0;   ///< left the scene; measured by rays that met nothing, not by subtraction
  double unshot = 0;    ///< Σ (E + ρH - S) A
  double mirrored = 0;  ///< what mirrors pass on of what the first pass sees them absorb (core/tracing/mirror_light)
  double mirrored_direct = 0;  ///< the part of it that comes straight from luminaires
  double gain_direct = 1,
         gain_indirect = 1;  ///< of the light that has arrived: they close the ledger (core/light/balance)
  /// Of the light as it has arrived, without the gains: how far factors and shadows err as a whole.
  double residual() const { return emitted > 0 ? (emitted - absorbed - escaped - unshot) / emitted : 0.0; }
};

struct SolveCounters {
  std::uint64_t shots = 0;
  std::uint64_t rays = 0;              ///< shadow rays answered
  std::uint64_t rays_saved = 0;        ///< those answered without the ray tracer
  std::uint64_t rays_remembered = 0;   ///< those of them that an earlier shot had asked
  std::uint64_t form_factors = 0;      ///< receiver-shooter pairs
  std::uint64_t messages = 0;          ///< hemicube messages between cells
  std::uint64_t bytes_sent = 0;        ///< of those, as on the wire
  std::uint64_t bitmap_bytes = 0;      ///< compressed bitmaps alone
  std::uint64_t bitmap_bytes_raw = 0;  ///< what they would be uncompressed
  std::uint64_t cells_skipped = 0;     ///< visits saved: behind the shooter or wholly covered
  std::uint64_t clusters_tested = 0;   ///< receivers of a shot, 16 at a time
  std::uint64_t clusters_behind = 0;   ///< skipped: behind the shooter or facing away
  std::uint64_t clusters_hidden = 0;   ///< skipped: one surface hides them all
  std::uint64_t clusters_cut = 0;      ///< skipped: so far away that they get nothing that counts

  SolveCounters& operator+=(const SolveCounters& other) {
    shots += other.shots;
    rays += other.rays;
    rays_saved += other.rays_saved;
    rays_remembered += other.rays_remembered;
    form_factors += other.form_factors;
    messages += other.messages;
    bytes_sent += other.bytes_sent;
    bitmap_bytes += other.bitmap_bytes;
    bitmap_bytes_raw += other.bitmap_bytes_raw;
    cells_skipped += other.cells_skipped;
    clusters_tested += other.clusters_tested;
    clusters_behind += other.clusters_behind;
    clusters_hidden += other.clusters_hidden;
    clusters_cut += other.clusters_cut;
    return *this;
  }
};

/// The state of the first pass: arrays have one entry per element of the mesh (W/m²).
struct Solution {
  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const Mesh> mesh;
  SolveOptions options;
  std::vector<Rgbf> irradiance;         ///< H, all light received
  std::vector<Rgbf> direct_irradiance;  ///< the part of H that came straight from luminaires
  std::vector<Rgbf> shot;               ///< S, radiosity distributed so far
  std::vector<Rgbf> pending;  ///< estimate of the irradiance still to come from unshot light; for display only
  EnergyLedger energy;
  SolveCounters counters;
  double seconds_radiosity = 0;
  bool converged = false;

  /// Indirect irradiance of an element (W/m²): what the second pass adds to light it samples itself.
  Rgb indirect(std::size_t element) const {
    const Rgb h{irradiance[element]}, d{direct_irradiance[element]};
    return energy.gain_indirect * (h - d + (pending.empty() ? Rgb{0.0} : Rgb{pending[element]}));
  }
  /// All irradiance of an element (W/m²), as near as the first pass comes to it; the arrays are what it goes on from.
  Rgb total(std::size_t element) const {
    return energy.gain_direct * Rgb{direct_irradiance[element]} + indirect(element);
  }
};

}  // namespace lichthof
