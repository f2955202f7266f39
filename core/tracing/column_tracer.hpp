/// The second pass (§3): Whitted-style ray tracing of columns, with the first pass's radiosity in place of the constant
/// ambient term. Every light path is counted once:
///
/// | method    | light reflected diffusely at a point             | what it is for                                    |
/// |-----------|--------------------------------------------------|---------------------------------------------------|
/// | radiosity | ρ/π · H, interpolated                            | the first pass as it is                           |
/// | raytrace  | ρ/π · (direct + constant)                        | "the generic ray tracing algorithm" of §3         |
/// | two-pass  | ρ/π · (direct + (H − H_direct), interpolated)    | the paper's two pass method                       |
///
/// Direct light is sampled here (direct_light), so the field must not hold it; mirrors, glass and glossy lobes are followed
/// by rays and see luminaires themselves.
#pragma once

#include <atomic>
#include <memory>
#include <optional>

#include "core/base/parallel.hpp"
#include "core/tracing/camera.hpp"
#include "core/tracing/column_source.hpp"
#include "core/tracing/final_gather.hpp"
#include "core/tracing/lit_scene.hpp"

namespace lichthof {

enum class TracingMethod : std::uint8_t { radiosity, raytrace, two_pass };

struct TracingOptions {
  TracingMethod method = TracingMethod::two_pass;
  std::uint32_t samples = 8;      ///< rays per pixel
  std::uint32_t depth = 12;       ///< mirrors and panes along one path
  double throughput_cut = 2e-3;   ///< a path whose weight falls below is given up
  std::uint32_t lobe_rays = 4;    ///< through a glossy lobe, at its first meeting
  std::uint32_t gather_rays = 0;  ///< two-pass: 0 reads the field at the point, else a final gather there
  std::optional<Rgb> ambient{};   ///< raytrace: constant irradiance (W/m²); unset: LitScene::mean_indirect()
  /// When it becomes true, what is left of a job is black: a column may take seconds, and its picture is thrown away.
  const std::atomic<bool>* stop = nullptr;
};

/// Random numbers come from (pixel, sample, bounce) alone: the picture has the same bits for any partition into jobs, any
/// number of workers and threads.
class ColumnTracer : public ColumnSource {
 public:
  /// @pre methods radiosity and two_pass need a solution in the scene
  ColumnTracer(std::shared_ptr<const LitScene> scene, const PinholeCamera& camera, const TracingOptions& options,
               std::shared_ptr<const Parallel> parallel);

  std::uint32_t width() const override { return camera_.width(); }
  std::uint32_t height() const override { return camera_.height(); }
  std::vector<Rgbf> columns(const ColumnJob& job, std::uint64_t& rays) const override;
  std::size_t memory_bytes() const override;

  /// Radiance (W/(m² sr)) of one pixel. @cost per sample: one ray + about 16 shadow rays per important luminaire
  Rgb pixel(std::uint32_t column, std::uint32_t row, std::uint64_t& rays) const;

 private:
  /// A ray under way.
  struct Path {
    Vec3 from, direction;
    double throughput = 1;  ///< largest channel
    std::uint32_t depth = 0;
    std::uint64_t seed = 0;
    bool through_lobe = false;
  };
  Rgb radiance(const Path& path, std::uint64_t& rays) const;
  Rgb diffuse_irradiance(const SurfacePoint& at, const Path& path, std::uint64_t& rays) const;
  Rgb through_glass(const SurfacePoint& at, const Path& path, const Material& material, std::uint64_t& rays) const;
  Rgb through_lobe(const SurfacePoint& at, const Path& path, const Material& material, const Rgb& share,
                   std::uint64_t& rays) const;

  std::shared_ptr<const LitScene> scene_;
  PinholeCamera camera_;
  TracingOptions options_;
  std::shared_ptr<const Parallel> parallel_;
  std::optional<FinalGather> gather_;
  Rgb ambient_;
  std::uint32_t direct_rays_;  ///< shadow rays per luminaire and sample
};

/// Place `index` of `count` samples inside a pixel: the middle for one, else an R2 sequence turned by the pixel's hash.
Vec2 place_in_pixel(std::uint32_t index, std::uint32_t count, std::uint64_t pixel_seed);

}  // namespace lichthof
