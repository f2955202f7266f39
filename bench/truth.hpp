/// The truth to measure errors by: irradiance at random points of a scene's surfaces, by path tracing, with its standard
/// error. This file knows how the points are drawn and what "error" means:
///
///     error = RMS of (E - E_true) / RMS of E_true, both over points and channels
///
/// Points are uniform over the lit area, so this is the error over the surfaces.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "bench/bench_case.hpp"
#include "core/base/parallel.hpp"
#include "core/tracing/path_tracer.hpp"

namespace lichthof::bench {

struct Truth {
  std::vector<SensorPoint> points;
  std::vector<Estimate> irradiance;  ///< one per point, W/m²
  std::uint32_t paths = 0;           ///< at each point; 0: known from elsewhere
};

/// Random points, uniform over the area of all surface sides that light reaches; the same for the same mesh and seed.
std::vector<SensorPoint> surface_points(const Mesh& mesh, std::size_t count, std::uint64_t seed);

/// Irradiance (W/m²) at points by path tracing.
/// @param paths  at each point, ≥ 2
/// @param seed   other seeds give independent paths
/// @param show   called with the share done; may be empty
/// @error interrupted
Expected<std::vector<Estimate>> path_traced(const BenchCase& scene, const PathTracer& tracer,
                                            std::span<const SensorPoint> points, std::uint32_t paths,
                                            std::uint64_t seed, const Parallel& parallel,
                                            const std::function<void(double)>& show = {});

/// What the first pass alone says at points on surfaces: its irradiance, interpolated (W/m²).
std::vector<Rgb> first_pass_irradiance(const LitScene& lit, std::span<const SensorPoint> points);

/// Two independent estimates as one. @param first_paths, second_paths  what stands behind each
Estimate merged(const Estimate& first, double first_paths, const Estimate& second, double second_paths);

/// The error as it is measured; what the truth itself is off by is still in it. 0 where all is dark.
double relative_error(std::span<const Rgb> some, std::span<const Estimate> truth);

/// RMS of the standard errors over RMS of the truth. 0 where all is dark.
double standard_error(std::span<const Estimate> truth);

/// The error without the truth's part of it, from which it is independent: √(measured² - standard_error²), or 0 where
/// nothing is left.
double without_noise(double measured, double standard_error);

}  // namespace lichthof::bench
