#include "core/tracing/picture_source.hpp"

#include "core/tracing/path_tracer.hpp"

namespace lichthof {

std::unique_ptr<const ColumnSource> picture_source(std::shared_ptr<const LitScene> scene, const PictureWish& wish) {
  const auto alone = std::make_shared<const Parallel>(1);
  const PinholeCamera film(wish.camera, wish.width, wish.height);
  if (wish.path_tracing)
    return std::make_unique<ReferenceTracer>(std::move(scene), film, wish.samples, alone, wish.stop);
  TracingOptions options;
  options.method = wish.method;
  options.samples = wish.samples;
  options.gather_rays = wish.gather_rays;
  options.stop = wish.stop;
  return std::make_unique<ColumnTracer>(std::move(scene), film, options, alone);
}

}  // namespace lichthof
