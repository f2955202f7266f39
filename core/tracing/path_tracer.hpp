/// Method `reference`: an unbiased path tracer, to measure the others by. Slow, and right: every figure comes with its
/// standard error.
///
/// Paths start at the eye or at a sensor, hit luminaires by chance and by shadow rays to them; both are combined by the
/// balance heuristic [Veach95], so nothing is counted twice. Russian roulette ends paths. Clear panes pass straight; solid
/// glass refracts, and light through it is found by chance only.
#pragma once

#include <atomic>
#include <memory>
#include <span>

#include "core/base/parallel.hpp"
#include "core/base/random.hpp"
#include "core/tracing/camera.hpp"
#include "core/tracing/column_source.hpp"
#include "core/tracing/lit_scene.hpp"
#include "core/tracing/sensor_point.hpp"

namespace lichthof {

/// Mean of independent samples and its standard error.
struct Estimate {
  Rgb mean{0.0}, standard_error{0.0};
};

class PathTracer {
 public:
  explicit PathTracer(std::shared_ptr<const LitScene> scene) : scene_(std::move(scene)) {}
  const LitScene& scene() const { return *scene_; }

  /// Radiance (W/(m² sr)) of a pixel, box filter. @param samples ≥ 2 for an error
  Estimate pixel(const PinholeCamera& camera, std::uint32_t column, std::uint32_t row, std::uint32_t samples,
                 std::uint64_t& rays) const;
  /// Irradiance (W/m²) at a sensor point.
  Estimate irradiance(const SensorPoint& sensor, std::uint32_t samples, std::uint64_t seed, std::uint64_t& rays) const;

  /// One path: radiance along a ray, without bias.
  Rgb radiance(const Vec3& from, const Vec3& direction, Random& random, std::uint64_t& rays) const;

  /// What a surface scatters back along a ray that has met it: radiance without its own emission, by one path, without bias.
  Rgb reflected(const SurfacePoint& at, const Vec3& direction, Random& random, std::uint64_t& rays) const;

 private:
  /// A point that scatters other than by mirrors and glass, and how: cosine lobe and Phong lobe.
  struct Scatterer {
    SurfacePoint at;
    Vec3 mirror{0.0};  ///< axis of the lobe
    Rgb diffuse{0.0}, glossy{0.0};
    double exponent = 0;
    double diffuse_chance = 1;                    ///< that the next direction is drawn from the cosine lobe
    Rgb value(const Vec3& direction) const;       ///< f (1/sr)
    double density(const Vec3& direction) const;  ///< of the drawn directions (1/sr)
  };
  Rgb lit_directly(const Scatterer& scatterer, Random& random, std::uint64_t& rays) const;
  /// @param met  what the ray meets first, where that is known; its emission does not count
  Rgb traced(Vec3 from, Vec3 direction, Rgb throughput, double density, Random& random, std::uint64_t& rays,
             const SurfacePoint* met = nullptr) const;

  std::shared_ptr<const LitScene> scene_;
};

/// Irradiance at sensor points with standard errors; the same for any number of threads.
std::vector<Estimate> reference_irradiance(const PathTracer& tracer, std::span<const SensorPoint> points,
                                           std::uint32_t samples, const Parallel& parallel, std::uint64_t& rays);

/// The reference as a column source, for the same balancer and workers as every other method.
class ReferenceTracer : public ColumnSource {
 public:
  /// @param stop  as in TracingOptions
  ReferenceTracer(std::shared_ptr<const LitScene> scene, const PinholeCamera& camera, std::uint32_t samples,
                  std::shared_ptr<const Parallel> parallel, const std::atomic<bool>* stop = nullptr)
      : tracer_(std::move(scene)), camera_(camera), samples_(samples), parallel_(std::move(parallel)), stop_(stop) {}
  std::uint32_t width() const override { return camera_.width(); }
  std::uint32_t height() const override { return camera_.height(); }
  std::vector<Rgbf> columns(const ColumnJob& job, std::uint64_t& rays) const override;
  std::size_t memory_bytes() const override;
  /// The same with the standard error of every pixel.
  std::vector<Estimate> estimates(const ColumnJob& job, std::uint64_t& rays) const;

 private:
  PathTracer tracer_;
  PinholeCamera camera_;
  std::uint32_t samples_;
  std::shared_ptr<const Parallel> parallel_;
  const std::atomic<bool>* stop_;
};

}  // namespace lichthof
