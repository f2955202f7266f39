/// From a lit scene and what a picture shall be like to what workers trace: the one place that turns wishes into options.
#pragma once

#include <memory>

#include "core/tracing/column_source.hpp"
#include "core/tracing/column_tracer.hpp"

namespace lichthof {

struct PictureWish {
  bool path_tracing = false;  ///< the unbiased reference, instead of `method`
  TracingMethod method = TracingMethod::two_pass;
  Camera camera;  ///< checked
  std::uint32_t width = 640, height = 480;
  std::uint32_t samples = 4;
  std::uint32_t gather_rays = 0;
  const std::atomic<bool>* stop = nullptr;  ///< as in TracingOptions
};

/// Traces on the calling thread alone: each worker is a thread of its own.
/// @pre the methods radiosity and two_pass need a solution in the scene
std::unique_ptr<const ColumnSource> picture_source(std::shared_ptr<const LitScene> scene, const PictureWish& wish);

}  // namespace lichthof
