/// What a picture is to be like, as `render` and `submit` are told it: the same options, the same bounds, the same picture.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "apps/common/options.hpp"
#include "core/tracing/balancer.hpp"

namespace lichthof::apps {

struct PictureOptions {
  std::optional<std::string> camera;  ///< numbers or a name; unset: the scene's first, or one that frames it
  std::string size = "640x480";
  std::uint32_t width = 640, height = 480;  ///< the same
  std::optional<std::uint32_t> samples;
  std::optional<std::uint32_t> gather_rays;  ///< unset: none
  std::optional<double> exposure_ev;  ///< of a .png
  std::string solution;               ///< file to keep the first pass in; empty: none
  Scheduling scheduling = Scheduling::adaptive;
};

/// Adds --camera --size --samples --gather --exposure --solution.
void add_picture_options(CLI::App& command, PictureOptions& options);

/// Whether the options mean something to a method. @error bad_input naming the option
Status picture_fits(const PictureOptions& options, Method method);

}  // namespace lichthof::apps
